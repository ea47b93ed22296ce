#include "core/codec/heights/holes.h"

#include <algorithm>
#include <utility>

namespace rilievo {
namespace {

// Calls visit(u, v) for the edges of level `max_level`, those within two faces twice.
template <typename Visit>
void ForEachEdge(const LoopRefinement& refinement, int max_level, Visit visit) {
  const MeshTopology& topology = refinement.levels[std::max(0, max_level - 1)];
  for (int f = 0; f < topology.face_count(); ++f) {
    const Eigen::Vector3i corner = topology.faces.col(f);
    const Eigen::Vector3i middle = topology.face_edges.col(f).array() + topology.vertex_count;
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      if (max_level == 0) {
        visit(corner[k], corner[next]);
        continue;
      }
      visit(corner[k], middle[k]);
      visit(middle[k], corner[next]);
      visit(middle[k], middle[next]);
    }
  }
}

}  // namespace

std::vector<uint8_t> RingsIntoHoles(const LoopRefinement& refinement, int max_level, int most,
                                    const std::vector<uint8_t>& filled) {
  const auto farther = static_cast<uint8_t>(most + 1);
  std::vector<uint8_t> rings(filled.size());
  for (size_t v = 0; v < rings.size(); ++v) rings[v] = filled[v] != 0 ? farther : 0;
  for (uint8_t ring = 1; ring < farther; ++ring) {
    ForEachEdge(refinement, max_level, [&](int u, int v) {
      if (rings[u] > ring && rings[v] == ring - 1) rings[u] = ring;
      if (rings[v] > ring && rings[u] == ring - 1) rings[v] = ring;
    });
  }
  return rings;
}

void DropSmallHoles(const LoopRefinement& refinement, int max_level, int smallest,
                    std::vector<uint8_t>& filled) {
  std::vector<int> parent(filled.size()), count(filled.size(), 1);
  for (size_t v = 0; v < parent.size(); ++v) parent[v] = static_cast<int>(v);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  const auto join = [&](int u, int v) {
    if (filled[u] == 0 || filled[v] == 0) return;
    u = root(u);
    v = root(v);
    if (u == v) return;
    if (count[u] < count[v]) std::swap(u, v);
    parent[v] = u;
    count[u] += count[v];
  };
  ForEachEdge(refinement, max_level, join);
  const std::vector<uint8_t> all = filled;
  for (size_t v = 0; v < filled.size(); ++v) {
    if (all[v] != 0 && count[root(static_cast<int>(v))] < smallest) filled[v] = 0;
  }
}

void DropSmallPatches(const LoopRefinement& refinement, int max_level, int smallest,
                      const std::vector<uint8_t>& filled, std::vector<uint8_t>& smoothed) {
  DropSmallHoles(refinement, max_level, smallest, smoothed);
  std::vector<uint8_t> measured(smoothed.size());
  for (size_t v = 0; v < smoothed.size(); ++v) measured[v] = (filled[v] | smoothed[v]) == 0;
  DropSmallHoles(refinement, max_level, smallest, measured);
  for (size_t v = 0; v < smoothed.size(); ++v) smoothed[v] = (filled[v] | measured[v]) == 0;
}

}  // namespace rilievo
