// What the masks of all schemes have in common around a vertex with sharp edges.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/loop/crease_masks.h"
#include "core/loop/crease_topology.h"

namespace rilievo {

inline int Valence(const SharpRing& ring) { return static_cast<int>(ring.sharpness.size()); }

inline std::vector<int> SharpSpokes(const SharpRing& ring) {
  std::vector<int> spokes;
  for (int i = 0; i < Valence(ring); ++i) {
    if (ring.sharpness[i] > 0.0f) spokes.push_back(i);
  }
  return spokes;
}

inline VertexKind KindOf(const SharpRing& ring, const std::vector<int>& sharp_spokes) {
  if (ring.corner) return VertexKind::kCorner;
  return static_cast<VertexKind>(std::min<size_t>(sharp_spokes.size(), 3));
}

inline SharpRing NextRing(const SharpRing& ring) {
  SharpRing next = ring;
  for (float& sharpness : next.sharpness) sharpness = SharpnessOfHalves(sharpness);
  return next;
}

// Of `entries` weights: `self` for the vertex, `neighbor` for each of `spokes`.
inline std::vector<double> Spread(size_t entries, double self, double neighbor,
                                  const std::vector<int>& spokes) {
  std::vector<double> weights(entries, 0.0);
  weights[0] = self;
  for (int i : spokes) weights[1 + i] = neighbor;
  return weights;
}

// Mean of the sharpnesses that the next level no longer has, at most 1.
inline double WeightOfParentRule(const SharpRing& ring, const SharpRing& next) {
  float sum = 0.0f;
  int count = 0;
  for (size_t i = 0; i < ring.sharpness.size(); ++i) {
    if (ring.sharpness[i] <= 0.0f || next.sharpness[i] > 0.0f) continue;
    sum += ring.sharpness[i];
    ++count;
  }
  return count > 0 ? std::min(1.0f, sum / static_cast<float>(count)) : 0.0;
}

// The vertex on the next level, as crease_masks.h says. `smooth()`: the weights of the smooth mask.
template <typename Smooth>
std::vector<double> VertexWeightsBy(const SharpRing& ring, size_t entries, const Smooth& smooth) {
  const auto of_kind = [&](VertexKind kind, const std::vector<int>& spokes) {
    if (kind == VertexKind::kCorner) return Spread(entries, 1.0, 0.0, {});
    if (kind == VertexKind::kCrease) return Spread(entries, 0.75, 0.125, spokes);
    return smooth();
  };
  const std::vector<int> spokes = SharpSpokes(ring);
  const VertexKind kind = KindOf(ring, spokes);
  std::vector<double> weights = of_kind(kind, spokes);
  if (kind < VertexKind::kCrease || ring.corner) return weights;
  const SharpRing next = NextRing(ring);
  const std::vector<int> next_spokes = SharpSpokes(next);
  const VertexKind next_kind = KindOf(next, next_spokes);
  if (next_kind == kind) return weights;
  const double parent = WeightOfParentRule(ring, next);
  const std::vector<double> child = of_kind(next_kind, next_spokes);
  for (size_t i = 0; i < weights.size(); ++i) {
    weights[i] = parent * weights[i] + (1.0 - parent) * child[i];
  }
  return weights;
}

// The sides between successive sharp edges; on the boundary the last one ends the ring.
template <typename MakeSector>
std::vector<SharpSector> SectorsBetween(const SharpRing& ring, const std::vector<int>& spokes,
                                        const MakeSector& make) {
  std::vector<SharpSector> sectors;
  for (size_t s = 0; s + ring.boundary < spokes.size(); ++s) {
    const int end = s + 1 < spokes.size() ? spokes[s + 1] : spokes[0] + Valence(ring);
    sectors.push_back(make(ring, spokes[s], end - spokes[s]));
  }
  return sectors;
}

// The masks of the ring that is left when all semi-sharp edges are smooth, `settled(ring)`, drawn
// back through the subdivision matrices, `times(ring, row)`.
template <typename Settled, typename Times>
SharpLimitMask LimitBy(const SharpRing& ring, const Settled& settled, const Times& times) {
  const auto is_semi_sharp = [](float s) { return s > 0.0f && s < kInfiniteSharpness; };
  if (std::none_of(ring.sharpness.begin(), ring.sharpness.end(), is_semi_sharp)) {
    return settled(ring);
  }
  SharpLimitMask mask = LimitBy(NextRing(ring), settled, times);
  mask.position = times(ring, mask.position);
  for (SharpSector& sector : mask.sectors) {
    for (std::vector<double>* tangent : {&sector.tangent_u, &sector.tangent_v}) {
      *tangent = times(ring, *tangent);
      for (double& weight : *tangent) weight *= 2.0;  // rings halve: tangents keep their size
    }
  }
  return mask;
}

}  // namespace rilievo
