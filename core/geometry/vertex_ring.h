// The neighbours of one vertex in a table of all.
#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/mesh_topology.h"

namespace rilievo {

// In the order of VertexRings, for as long as `rings` lives.
inline std::span<const int> RingOf(const VertexRings& rings, int vertex) {
  const auto v = static_cast<size_t>(vertex);
  return {rings.neighbors.data() + rings.neighbor_begin[v],
          rings.neighbors.data() + rings.neighbor_begin[v + 1]};
}

}  // namespace rilievo
