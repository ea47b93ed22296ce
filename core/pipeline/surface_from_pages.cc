#include "core/pipeline/surface_from_pages.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/pipeline/analyze_pages.h"
#include "core/pipeline/code_stored_surface.h"
#include "core/pipeline/fit_from_pages.h"
#include "core/pipeline/heights_from_pages.h"
#include "core/pipeline/points_of_pages.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/settings.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

namespace {

// SomePoints() of all `count` points of the surface.
absl::StatusOr<Eigen::Matrix3Xd> SomeOfPages(const PointsOfPages& points, int64_t count,
                                             const RunContext& context) {
  const int64_t most = kCertificate.certified_samples;
  const int64_t stride = std::max<int64_t>(1, (count + most - 1) / most);
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

struct MeasuredPages {
  AnalyzedPages analyzed;
  ScratchHeights heights;
};

// Control points and heights of `stored`, which is `coarse` at another level, from all points. The
// control points stay where the thinned points are all there are, and where arcs, which no fit
// knows of, have filled holes.
absl::StatusOr<MeasuredPages> MeasurePages(const PagedScan& pages, const PartSizes& sizes,
                                           const ScanSurface& thinned,
                                           const DisplacedSurface& coarse, const PartCutter& cutter,
                                           const ReconstructOptions& options, SharedParts* shared,
                                           const PipelineContext& context, Domain* domain,
                                           StoredSurface* stored) {
  const StageScope scope(Stage::kDisplacement, context);
  const auto told = [&context, shared](double from, double to) {
    const auto tell = [&context, from, to](double share) {
      context.Report(Stage::kDisplacement, from + (to - from) * share);
    };
    return PartsRun{tell, shared};
  };
  const PipelineContext silent = context.Silent();
  RILIEVO_ASSIGN_OR_RETURN(AnalyzedPages analyzed,
                           AnalyzePages(pages, thinned, sizes.part_points, options,
                                        told(0, kSurfaceFromPages.analyzed), silent));
  const KnownPoints points{pages, analyzed.surfels, thinned.frame};
  const FaceParts parts(pages, thinned, coarse, cutter, sizes.part_points);
  if (pages.size() > sizes.coarse_points && !domain->is_filled) {
    domain->fit.control_mesh = stored->control_mesh;
    RILIEVO_ASSIGN_OR_RETURN(
        domain->fit,
        FitFromPages(points, parts, cutter, domain->fit, options.fit,
                     told(kSurfaceFromPages.analyzed, kSurfaceFromPages.fitted), silent));
    RILIEVO_ASSIGN_OR_RETURN(stored->control_mesh,
                             QuantizeControlMesh(domain->fit.control_mesh, domain->position_step));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchHeights heights,
      MeasureHeightsFromPages(points, parts, cutter, stored->max_level, options.displacement,
                              told(kSurfaceFromPages.fitted, 1), silent));
  return MeasuredPages{std::move(analyzed), std::move(heights)};
}

// The coarse surface, to be measured at another level.
absl::StatusOr<StoredSurface> BeginStored(const PagedScan& pages, const CoarseSurface& coarse) {
  const DisplacedSurface& surface = coarse.sampled.surface;
  StoredSurface stored{surface.frame, surface.control_mesh};
  RILIEVO_ASSIGN_OR_RETURN(stored.max_level,
                           LevelFor(coarse.options, pages.size(), coarse.all_points.spacing,
                                    coarse.all_points.noise, stored.control_mesh.faces.cols()));
  return stored;
}

// How a surface is coded.
struct Grouping {
  Grouping(const StoredSurface& stored, const PartCutter& cutter, const PartSizes& sizes,
           const ReconstructOptions& given)
      : options(given) {
    const auto group = GroupFacesFor(stored, cutter, sizes.block_vertices, given.encode);
    block = {sizes.block_vertices, sizes.part_points, group.has_value()};
    if (group) options.encode.group_faces = *group;
  }

  ReconstructOptions options;
  BlockSize block;
};

}  // namespace

absl::Status HelpFromPages(const PagedScan& pages, const PartSizes& sizes, SharedParts* shared,
                           const PipelineContext& context, CoarseSurface* coarse) {
  RILIEVO_ASSIGN_OR_RETURN(StoredSurface stored, BeginStored(pages, *coarse));
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(stored.control_mesh));
  RILIEVO_ASSIGN_OR_RETURN(
      const MeasuredPages measured,
      MeasurePages(pages, sizes, coarse->scan, coarse->sampled.surface, cutter, coarse->options,
                   shared, context, &coarse->sampled.domain, &stored));
  stored.heights = &measured.heights;
  stored.source_counts = measured.heights.source_counts();
  { const ScanSurface spent = std::move(coarse->scan); }
  const Grouping grouping(stored, cutter, sizes, coarse->options);
  RILIEVO_ASSIGN_OR_RETURN(PointsOfPages points,
                           PointsOfPages::Create(pages, measured.analyzed.surfels, stored.frame));
  return HelpToCode(stored, cutter, &points, coarse->sampled.domain.position_step, grouping.block,
                    shared, grouping.options, context);
}

absl::StatusOr<FinishedSurface> FinishFromPages(const PagedScan& pages, const PartSizes& sizes,
                                                const DssMetadata& metadata, SharedParts* shared,
                                                const PipelineContext& context,
                                                CoarseSurface* coarse) {
  RILIEVO_ASSIGN_OR_RETURN(StoredSurface stored, BeginStored(pages, *coarse));
  const ReconstructOptions& options = coarse->options;
  ScanSurface scan = std::move(coarse->scan);
  SampledSurface sampled = std::move(coarse->sampled);
  DisplacedSurface& surface = sampled.surface;
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(stored.control_mesh));
  RILIEVO_ASSIGN_OR_RETURN(const MeasuredPages measured,
                           MeasurePages(pages, sizes, scan, surface, cutter, options, shared,
                                        context, &sampled.domain, &stored));
  surface.control_mesh = stored.control_mesh;
  stored.heights = &measured.heights;
  stored.source_counts = measured.heights.source_counts();
  surface.max_level = stored.max_level;
  FreeMemoryOf(&surface.heights);
  FreeMemoryOf(&surface.sources);
  ThinnedPoints some{{}, coarse->all_points.spacing, coarse->all_points.noise, sampled.leverage};
  { const ScanSurface spent = std::move(scan); }

  const Grouping grouping(stored, cutter, sizes, options);
  RILIEVO_ASSIGN_OR_RETURN(PointsOfPages points,
                           PointsOfPages::Create(pages, measured.analyzed.surfels, stored.frame));
  if (options.measure && !options.encode.max_error) {
    RILIEVO_ASSIGN_OR_RETURN(some.some,
                             SomeOfPages(points, measured.analyzed.points_of_surface, context));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      CodedStoredSurface coded,
      CodeStoredSurface(stored, cutter, some, &points, sampled.domain.position_step, metadata,
                        grouping.block, pages.scratch_folder(), shared, grouping.options, context));
  if (!grouping.block.in_groups) {
    RILIEVO_ASSIGN_OR_RETURN(surface, ReadWhole(stored, cutter));
  }
  FinishedSurface finished;
  finished.coded.domain = std::move(sampled.domain);
  finished.coded.surface = std::move(surface);
  finished.coded.metadata = std::move(coded.metadata);
  finished.coded.uncoded = coded.uncoded;
  finished.certified = {std::move(coded.encoded), coded.error};
  finished.source_counts = stored.source_counts;
  finished.points_used = measured.analyzed.points_of_surface;
  return finished;
}

}  // namespace rilievo
