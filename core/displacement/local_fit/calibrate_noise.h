// How far the noise stated per point is from what wide neighbourhoods show.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/ray_cloud.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

// Sets the noise of each point anew. Where noise and spacing are alike, a fit to the nearest
// sixteen points tilts and bends into the noise and understates it (by a third at a ratio of 0.7),
// and all that is decided "within the noise" later would be decided wrongly. Where the points
// around span detail, it is overstated. Over a few hundred points noisier than `least_ratio` times
// their spacing quadrics are put through those nearest to the point's normal:
// - The lower middle of their residuals, over the stated noise, is a factor for all points.
//   Residuals that grow with the size of the neighbourhood are of detail that it spans: there the
//   factor is what residuals of three sizes lead to where no size is left.
// - A scanner's noise is often the same everywhere. The more the quantiles of the residuals agree
//   with that, and the thicker the noise, the more of it is given to all points: detail adds least
//   to the lowest quantile.
// Scans with fewer than some thirty such points, clean ones, stay as they are.
absl::Status CalibrateNoise(const NeighborGraph& graph, float least_ratio,
                            const RunContext& context, RayCloud* cloud);

}  // namespace rilievo
