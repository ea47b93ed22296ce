// The surface of a scan on disk whose thinned points have a control mesh.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/paging/paged_scan.h"
#include "core/pipeline/finished_surface.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/shape_input.h"
#include "core/pipeline/stage_scope.h"

namespace rilievo {

// More control faces than a scan in memory gets, where its points ask for them and the `thinned`
// ones can carry them.
ReconstructOptions WithFacesForPages(ReconstructOptions options, const PagedScan& pages,
                                     int64_t thinned);

// What ReconstructPaged() does with the thinned points once they are shaped; `thinned` is spent.
// `faces_given`: the number of control faces is the caller's. `metadata`: what is known before.
absl::StatusOr<FinishedSurface> FinishFromPages(const PagedScan& pages, const PartSizes& sizes,
                                                bool faces_given, const DssMetadata& metadata,
                                                const PipelineContext& context,
                                                ShapedInput* thinned);

}  // namespace rilievo
