// How exactly heights are worth coding.
#pragma once

#include "core/pipeline/reconstruct.h"

namespace rilievo {

// Estimate of the surface's RMS distance from the truth before coding, fraction of the diagonal. On
// a clean scan that of the points from the surface; on a noisy one about a quarter of the noise is
// left in the surface. Of the distances the quieter of the RMS and half the 95th percentile counts,
// so that a few strays do not coarsen the rest. An eightieth of the spacing at least: a surface
// through its points is off between them.
double OwnError(const ReconstructReport& report, bool measured);

// Whether a surface that does not follow the noise can be within `max_error` of the points: that
// has to leave it at least half of the noise, 1.12^2 = 1 + 0.5^2.
bool NoiseAllows(double max_error, const ReconstructReport& report);

// RMS error of the coded heights that raises the surface's own error by a twentieth at most.
double CodingError(const ReconstructReport& report, bool measured);

// The same where the coded surface is to be within `max_error` of the points, as the certificate
// measures it (TwoSidedError::across_rms): errors of different origin add up as squares. Where the
// surface's own distance is larger already, or noise does not allow that (NoiseAllows),
// `max_error` is taken as meant against the truth, and shared with OwnError(). CodingError()
// where that too is larger. Without measuring there is OwnError() alone.
double CodingErrorWithin(double max_error, const ReconstructReport& report, bool measured);

}  // namespace rilievo
