#include "core/loop/level_rings.h"

#include <utility>

namespace rilievo {

LevelRings LevelRings::After(const MeshTopology& parent) {
  // Old vertices keep their rings, with the edges' vertices in the place of their other ends.
  VertexRings rings = BuildVertexRings(parent);
  for (int e = 0; e < parent.edge_count(); ++e) {
    for (int k = 0; k < 2; ++k) {
      const int v = parent.edge_vertices(k, e), other = parent.edge_vertices(1 - k, e);
      const auto begin = rings.neighbors.begin() + rings.neighbor_begin[v];
      const auto end = rings.neighbors.begin() + rings.neighbor_begin[v + 1];
      *std::find(begin, end, other) = parent.vertex_count + e;
    }
  }
  LevelRings result;
  result.parent_ = &parent;
  result.old_vertices_ = std::make_shared<const VertexRings>(std::move(rings));
  return result;
}

// Begins where BuildVertexRings does, at the first child face around the vertex; on the boundary at
// the outgoing half-edge.
Ring LevelRings::OfEdge(int edge) const {
  const EdgeStar star = StarOfEdge(*parent_, edge);
  std::array<int, 6> ring = RingOfEdgeVertex(star, parent_->vertex_count);
  if (star.boundary()) return Ring(ring, 4);
  if (CornerOfEdge(*parent_, parent_->edge_faces(0, edge), edge) < 2) {
    std::rotate(ring.begin(), ring.begin() + 2, ring.end());
  }
  return Ring(ring, 6);
}

}  // namespace rilievo
