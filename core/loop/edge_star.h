// What surrounds an edge, and so the vertex that Loop subdivision puts on it.
#pragma once

#include "core/geometry/mesh_topology.h"

namespace rilievo {

// The edge runs from `from` to `to` in its first face. The second face's members are -1 on the
// boundary.
struct EdgeStar {
  int from, to;
  int opposite_first, opposite_second;  // the third vertex of each face
  int after_first, before_first;        // first face: edges to - opposite, opposite - from
  int after_second, before_second;      // second face: edges from - opposite, opposite - to
  bool boundary() const { return opposite_second < 0; }
};

inline EdgeStar StarOfEdge(const MeshTopology& topology, int edge) {
  EdgeStar star;
  const int first = topology.edge_faces(0, edge), second = topology.edge_faces(1, edge);
  const int k = CornerOfEdge(topology, first, edge);
  star.from = topology.faces(k, first);
  star.to = topology.faces(kNextCorner[k], first);
  star.opposite_first = topology.faces(kPreviousCorner[k], first);
  star.after_first = topology.face_edges(kNextCorner[k], first);
  star.before_first = topology.face_edges(kPreviousCorner[k], first);
  star.opposite_second = star.after_second = star.before_second = -1;
  if (second >= 0) {
    const int j = CornerOfEdge(topology, second, edge);
    star.opposite_second = topology.faces(kPreviousCorner[j], second);
    star.after_second = topology.face_edges(kNextCorner[j], second);
    star.before_second = topology.face_edges(kPreviousCorner[j], second);
  }
  return star;
}

// Neighbours of the edge's vertex on the next level, counter-clockwise as in VertexRings: six, or
// four on the boundary.
inline std::array<int, 6> RingOfEdgeVertex(const EdgeStar& star, int parent_vertex_count) {
  return {
      star.to,   parent_vertex_count + star.after_first,  parent_vertex_count + star.before_first,
      star.from, parent_vertex_count + star.after_second, parent_vertex_count + star.before_second};
}

}  // namespace rilievo
