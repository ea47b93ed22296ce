// Fairness: a thin-plate energy of the control mesh.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/points/oriented_cloud.h"
#include "core/points/point_index.h"

namespace rilievo {

// The discrete thin-plate energy sum_v A_v |L c_v|^2 is that of the umbrella L c_v = (mean of the
// neighbours) - c_v, Kobbelt et al. 1998, with A_v of FairnessWeights(): a length
// squared, like the data term, whatever the number of control points. Along a boundary the umbrella
// has the two boundary neighbours only (second differences of the boundary curve, a cubic
// B-spline), so that no fairness pulls the border inwards.
struct Umbrella {
  std::vector<int> vertices;  // the vertex itself, then its neighbours
};
Umbrella UmbrellaOf(const DomainSamples& samples, int control_vertex);

// A_v of each control vertex: its share of the area and, where the noise sigma of the points is
// thick against control edges h, (7 sigma / h)^8 times as much. There the points lie so far off on
// both sides that the surface bends towards those it is nearest to, and these are then the ones it
// follows, however many others there are. What a stiff surface leaves of the shape the heights
// tell. h^2 is the vertex's area, or the mean one where that is larger: faces that are small
// because there is detail keep it. Reads the noise of `cloud`, unit frame as `surface`. CANCELLED
// when stopped.
absl::StatusOr<std::vector<double>> FairnessWeights(const OrientedCloud& cloud,
                                                    const PointIndex& index,
                                                    const SampledSurface& surface,
                                                    const AreaShares& areas,
                                                    const RunContext& context);

// Weight of round `round` of `rounds`: from `start` to `end` in equal ratios (in equal steps when
// one of them is zero); `end` when there is only one round.
double FairnessOfRound(double start, double end, int round, int rounds);

}  // namespace rilievo
