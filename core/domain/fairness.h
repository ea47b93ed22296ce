// Fairness: a thin-plate energy of the control mesh.
#pragma once

#include <vector>

#include "core/domain/domain_samples.h"

namespace rilievo {

// The discrete thin-plate energy sum_v A_v |L c_v|^2 is that of the umbrella L c_v = (mean of the
// neighbours) - c_v, Kobbelt et al. 1998, with A_v the vertex's share of the area: a length
// squared, like the data term, whatever the number of control points. Along a boundary the umbrella
// has the two boundary neighbours only (second differences of the boundary curve, a cubic
// B-spline), so that no fairness pulls the border inwards.
struct Umbrella {
  std::vector<int> vertices;  // the vertex itself, then its neighbours
};
Umbrella UmbrellaOf(const DomainSamples& samples, int control_vertex);

// Weight of round `round` of `rounds`: from `start` to `end` in equal ratios (in equal steps when
// one of them is zero); `end` when there is only one round.
double FairnessOfRound(double start, double end, int round, int rounds);

}  // namespace rilievo
