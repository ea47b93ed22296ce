// How exactly heights are worth coding.
#pragma once

#include "core/pipeline/reconstruct.h"

namespace rilievo {

// RMS error of the coded heights, fraction of the diagonal, that raises the surface's own error by
// a twentieth at most. That is told by the points: on a clean scan their distance from the surface
// is its error; on a noisy one about a quarter of the noise is left in the surface. Of the
// distances the quieter of the RMS and half the 95th percentile counts, so that a few strays do not
// coarsen the rest. Without a measurement a fiftieth of the spacing is taken for the error.
double CodingError(const ReconstructReport& report, bool measured);

}  // namespace rilievo
