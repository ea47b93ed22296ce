// How far the noise stated per point is from what wide neighbourhoods show.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/ray_cloud.h"
#include "core/scan/neighbor_graph.h"

namespace rilievo {

// The factor by which to multiply every noise. Where noise and spacing are alike, a fit to the
// nearest sixteen points tilts and bends into the noise and understates it (by a third at a ratio
// of 0.7), and all that is decided "within the noise" later would be decided wrongly. Found over a
// few hundred points noisier than `least_ratio` times their spacing: the lower middle of the
// residuals of quadrics through the 29 points nearest to the point's normal, over the stated noise.
// Residuals that grow with the size of the neighbourhood are of detail that it spans: there the
// factor is what residuals of three sizes lead to where no size is left. 1 when the scan is clean.
absl::StatusOr<float> NoiseCalibration(const RayCloud& cloud, const NeighborGraph& graph,
                                       float least_ratio, const RunContext& context);

}  // namespace rilievo
