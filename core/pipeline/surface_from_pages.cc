#include "core/pipeline/surface_from_pages.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/code_stored_surface.h"
#include "core/pipeline/fit_domain.h"
#include "core/pipeline/heights_from_pages.h"
#include "core/pipeline/points_of_pages.h"
#include "core/pipeline/sample_heights.h"
#include "core/surface/stored_surface.h"

namespace rilievo {
namespace {

// Heights of thinned points tell how far the surface reaches, no more: one level less than they
// would allow.
ReconstructOptions AtCoarseLevel(ReconstructOptions options, const OrientedCloud& thinned,
                                 int64_t control_faces) {
  constexpr double kPointsPerVertex = 4;
  const auto points = static_cast<double>(thinned.points.cols());
  options.max_level = LevelAsDenseAs(points / kPointsPerVertex, control_faces);
  return options;
}

}  // namespace

ReconstructOptions WithFacesForPages(ReconstructOptions options, const PagedScan& pages,
                                     int64_t thinned) {
  constexpr int64_t kFacesInMemory = 12000;  // at most
  constexpr int64_t kPointsPerFace = 120, kThinnedPerFace = 30;
  const int64_t faces = std::min(pages.size() / kPointsPerFace, thinned / kThinnedPerFace);
  if (faces > kFacesInMemory) options.control.target_faces = static_cast<int>(faces);
  return options;
}

absl::StatusOr<FinishedSurface> FinishFromPages(const PagedScan& pages, const PartSizes& sizes,
                                                bool faces_given, const DssMetadata& metadata,
                                                const PipelineContext& context,
                                                ShapedInput* thinned) {
  const ReconstructOptions& options = thinned->options;
  ScanSurface scan = std::move(thinned->scan);
  const auto fit = faces_given ? FitDomain : FitUnderNoise;
  RILIEVO_ASSIGN_OR_RETURN(Domain domain, fit(scan, thinned->control.mesh, options, context));
  const ReconstructOptions coarse =
      AtCoarseLevel(options, scan.cloud, domain.fit.control_mesh.faces.cols());
  RILIEVO_ASSIGN_OR_RETURN(
      SampledSurface sampled,
      SampleHeights(scan, thinned->control.topology, std::move(domain), coarse, context));
  sampled.shape = Shape();

  DisplacedSurface& surface = sampled.surface;
  StoredSurface stored{surface.frame, surface.control_mesh};
  RILIEVO_ASSIGN_OR_RETURN(stored.max_level, LevelFor(options, pages.size(), scan.cloud,
                                                      stored.control_mesh.faces.cols()));
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(stored.control_mesh));
  RILIEVO_ASSIGN_OR_RETURN(const MeasuredPages measured,
                           MeasureHeightsFromPages(pages, scan, surface, cutter, stored.max_level,
                                                   sizes.part_points, options, context));
  stored.heights = &measured.heights;
  stored.source_counts = measured.heights.source_counts();
  surface.max_level = stored.max_level;
  surface.heights = {};
  surface.sources = {};
  const ThinnedPoints some{SomePoints(scan.cloud.points), scan.cloud.median_spacing,
                           scan.cloud.median_noise};
  { const ScanSurface spent = std::move(scan); }

  const std::optional<int> group =
      GroupFacesFor(stored, cutter, sizes.block_vertices, options.encode);
  ReconstructOptions grouped = options;
  if (group) grouped.encode.group_faces = *group;
  RILIEVO_ASSIGN_OR_RETURN(PointsOfPages points,
                           PointsOfPages::Create(pages, measured.surfels, stored.frame));
  RILIEVO_ASSIGN_OR_RETURN(
      CodedStoredSurface coded,
      CodeStoredSurface(stored, cutter, some, &points, sampled.domain.position_step, metadata,
                        {sizes.block_vertices, group.has_value()}, grouped, context));
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
