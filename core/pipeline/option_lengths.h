// Lengths that are asked for in the scan's unit.
#pragma once

#include "absl/status/statusor.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// The options with fractions of the diagonal in the place of `lengths`. `diagonal`: of the points
// used, scan unit. INVALID_ARGUMENT, with the lengths that are possible, where one is out of range.
absl::StatusOr<ReconstructOptions> WithoutLengths(ReconstructOptions options, double diagonal);

}  // namespace rilievo
