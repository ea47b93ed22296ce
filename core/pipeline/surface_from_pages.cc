#include "core/pipeline/surface_from_pages.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/pipeline/code_stored_surface.h"
#include "core/pipeline/heights_from_pages.h"
#include "core/pipeline/points_of_pages.h"
#include "core/pipeline/sample_heights.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

namespace {

// SomePoints() of all `count` points of the surface.
absl::StatusOr<Eigen::Matrix3Xd> SomeOfPages(const PointsOfPages& points, int64_t count,
                                             const RunContext& context) {
  const int64_t stride = std::max<int64_t>(1, (count + kMostSomePoints - 1) / kMostSomePoints);
  std::vector<Eigen::Vector3d> some;
  int64_t seen = 0;
  for (int page = 0; page < points.count(); ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Shape shape, points.Read(page));
    for (const auto point : shape.vertices.colwise()) {
      if (seen++ % stride == 0) some.emplace_back(point);
    }
  }
  return Eigen::Map<const Eigen::Matrix3Xd>(some.empty() ? nullptr : some.front().data(), 3,
                                            static_cast<Eigen::Index>(some.size()));
}

}  // namespace

absl::StatusOr<FinishedSurface> FinishFromPages(const PagedScan& pages, const PartSizes& sizes,
                                                const DssMetadata& metadata,
                                                const PipelineContext& context,
                                                CoarseSurface* coarse) {
  const ReconstructOptions& options = coarse->options;
  ScanSurface scan = std::move(coarse->scan);
  SampledSurface sampled = std::move(coarse->sampled);
  DisplacedSurface& surface = sampled.surface;
  StoredSurface stored{surface.frame, surface.control_mesh};
  RILIEVO_ASSIGN_OR_RETURN(stored.max_level,
                           LevelFor(options, pages.size(), coarse->all_points.spacing,
                                    coarse->all_points.noise, stored.control_mesh.faces.cols()));
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(stored.control_mesh));
  RILIEVO_ASSIGN_OR_RETURN(const MeasuredPages measured,
                           MeasureHeightsFromPages(pages, scan, surface, cutter, stored.max_level,
                                                   sizes.part_points, options, context));
  stored.heights = &measured.heights;
  stored.source_counts = measured.heights.source_counts();
  surface.max_level = stored.max_level;
  surface.heights = {};
  surface.sources = {};
  ThinnedPoints some{{}, coarse->all_points.spacing, coarse->all_points.noise};
  { const ScanSurface spent = std::move(scan); }

  const std::optional<int> group =
      GroupFacesFor(stored, cutter, sizes.block_vertices, options.encode);
  ReconstructOptions grouped = options;
  if (group) grouped.encode.group_faces = *group;
  RILIEVO_ASSIGN_OR_RETURN(PointsOfPages points,
                           PointsOfPages::Create(pages, measured.surfels, stored.frame));
  if (options.measure && !options.encode.max_error) {
    RILIEVO_ASSIGN_OR_RETURN(some.some, SomeOfPages(points, measured.points_of_surface, context));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      CodedStoredSurface coded,
      CodeStoredSurface(stored, cutter, some, &points, sampled.domain.position_step, metadata,
                        {sizes.block_vertices, group.has_value()}, pages.scratch_folder(), grouped,
                        context));
  if (!group) {
    RILIEVO_ASSIGN_OR_RETURN(surface, ReadWhole(stored, cutter));
  }
  FinishedSurface finished;
  finished.coded.domain = std::move(sampled.domain);
  finished.coded.surface = std::move(surface);
  finished.coded.metadata = std::move(coded.metadata);
  finished.coded.uncoded = coded.uncoded;
  finished.certified = {std::move(coded.encoded), coded.error};
  finished.source_counts = stored.source_counts;
  finished.points_used = measured.points_of_surface;
  return finished;
}

}  // namespace rilievo
