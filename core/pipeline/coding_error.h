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

// RMS error of the coded heights that raises the surface's own error by a twentieth at most.
double CodingError(const ReconstructReport& report, bool measured);

// The same where the coded surface is to be within `max_error` of the truth: errors of different
// origin add up as squares. CodingError() where its own error is larger already.
double CodingErrorWithin(double max_error, const ReconstructReport& report, bool measured);

}  // namespace rilievo
