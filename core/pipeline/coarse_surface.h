// What the thinned points of a scan on disk tell: all that its parts agree on.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/control/build_control_mesh.h"
#include "core/paging/paged_scan.h"
#include "core/paging/shared_parts.h"
#include "core/pipeline/pages_to_thin.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/stage_scope.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

struct CoarseSurface {
  ScanSurface scan;            // thinned; without its neighbour graph and colours
  ControlMeshResult control;   // topology and reason alone
  PointMedians all_points;     // thinned or not
  SampledSurface sampled;      // without its shape; heights tell how far the surface reaches
  ReconstructOptions options;  // lengths as fractions of the diagonal
};

// LeftOutOfPages(); empty where the points need not be thinned. Processes that share the run share
// its parts; `shared` may be null.
absl::StatusOr<std::vector<bool>> LeftOutOfThinned(const PagedScan& pages, int64_t coarse_points,
                                                   const ReconstructOptions& options,
                                                   SharedParts* shared,
                                                   const PipelineContext& context);

// The points of the coarse pass, analyzed, and the medians of all points, which thinned ones do not
// have.
absl::StatusOr<ScanSurface> AnalyzeThinned(const PagedScan& pages, int64_t coarse_points,
                                           const std::vector<bool>& left_out,
                                           const ReconstructOptions& options,
                                           const PipelineContext& context, PointMedians* medians);

// All steps on the thinned points up to their heights. In a scratch folder that keeps its files the
// result is saved, and found there again. Of processes that share the run one does it for all;
// `shared` may be null.
absl::StatusOr<CoarseSurface> ShapeCoarsely(const PagedScan& pages, int64_t coarse_points,
                                            const ReconstructOptions& given, SharedParts* shared,
                                            const PipelineContext& context);

}  // namespace rilievo
