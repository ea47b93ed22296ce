// The fit of the domain to all points of a scan on disk, a part of the control faces at a time.
#pragma once

#include "absl/status/statusor.h"
#include "core/domain/fit_loop_domain.h"
#include "core/pipeline/analyze_pages.h"
#include "core/pipeline/face_parts.h"
#include "core/pipeline/run_parts.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// `start`: fitted to the thinned points, the control mesh of `cutter`. Each part is fitted with the
// faces within some rings around it, and has the control points that no part before it has. Where a
// scratch folder keeps its files the result is saved, and found there again.
absl::StatusOr<DomainFit> FitFromPages(const KnownPoints& points, const FaceParts& parts,
                                       const PartCutter& cutter, const DomainFit& start,
                                       const FitOptions& options, const PartsRun& run,
                                       const RunContext& context);

}  // namespace rilievo
