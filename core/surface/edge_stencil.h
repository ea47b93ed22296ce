// The vertices around an edge that a new vertex on it is predicted or interpolated from.
#pragma once

#include <array>

#include "core/geometry/mesh_topology.h"

namespace rilievo {

// The stencil of the butterfly scheme (Dyn, Levin, Gregory 1990): the two ends, the two vertices
// opposite the edge, and the four beyond the other edges of its two faces. -1 where the mesh ends.
struct EdgeStencil {
  std::array<int, 2> ends;
  std::array<int, 2> opposite = {-1, -1};
  std::array<int, 4> wings = {-1, -1, -1, -1};

  bool interior() const { return opposite[1] >= 0; }
  bool complete() const {
    return interior() && wings[0] >= 0 && wings[1] >= 0 && wings[2] >= 0 && wings[3] >= 0;
  }
};

// The vertex of `face` opposite `edge`.
inline int OppositeVertex(const MeshTopology& topology, int face, int edge) {
  return topology.faces((CornerOfEdge(topology, face, edge) + 2) % 3, face);
}

inline EdgeStencil StencilOfEdge(const MeshTopology& topology, int edge) {
  EdgeStencil stencil;
  stencil.ends = {topology.edge_vertices(0, edge), topology.edge_vertices(1, edge)};
  for (int side = 0; side < 2; ++side) {
    const int face = topology.edge_faces(side, edge);
    if (face < 0) break;
    const int corner = CornerOfEdge(topology, face, edge);
    stencil.opposite[side] = topology.faces((corner + 2) % 3, face);
    for (int wing = 0; wing < 2; ++wing) {
      const int other_corner = (corner + 1 + wing) % 3;
      const int neighbor = topology.face_neighbors(other_corner, face);
      if (neighbor < 0) continue;
      const int other_edge = topology.face_edges(other_corner, face);
      stencil.wings[2 * side + wing] = OppositeVertex(topology, neighbor, other_edge);
    }
  }
  return stencil;
}

}  // namespace rilievo
