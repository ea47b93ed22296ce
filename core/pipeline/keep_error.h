// An error asked for, kept as the certificate measures it.
#pragma once

#include "core/pipeline/build_surface.h"

namespace rilievo {

// How often the heights are coded and measured once more, at most.
inline constexpr int kKeepErrorRounds = 6;

// Decodes what was coded, measures it as CertifySurface does, and codes the heights more finely, or
// more coarsely where that takes fewer bytes, until the RMS across the surface is at most
// encode.max_error and close to it. `cloud`: the points that the surface was made from. `report`:
// of the same surface before coding, with error as BuildSurface leaves it. True if the error is
// kept; false leaves `coded` as the nearest one tried, or untouched where the surface itself is
// farther off than that or noise does not allow it. Without max_error or without measuring there is
// nothing to keep: true.
absl::StatusOr<bool> KeepError(const OrientedCloud& cloud, const ReconstructOptions& options,
                               const RunContext& context, ReconstructReport* report,
                               CodedSurface* coded);

}  // namespace rilievo
