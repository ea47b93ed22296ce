// The surface of a scan on disk whose thinned points have a control mesh.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/paging/paged_scan.h"
#include "core/paging/shared_parts.h"
#include "core/pipeline/coarse_surface.h"
#include "core/pipeline/finished_surface.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"

namespace rilievo {

// What ReconstructPaged() does with the coarse surface, which is spent. `metadata`: what is known
// before. `shared` may be null.
absl::StatusOr<FinishedSurface> FinishFromPages(const PagedScan& pages, const PartSizes& sizes,
                                                const DssMetadata& metadata, SharedParts* shared,
                                                const PipelineContext& context,
                                                CoarseSurface* coarse);

// What HelpWithParts() does with it.
absl::Status HelpFromPages(const PagedScan& pages, const PartSizes& sizes, SharedParts* shared,
                           const PipelineContext& context, CoarseSurface* coarse);

}  // namespace rilievo
