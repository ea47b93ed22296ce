// The quads that the triangles of a Catmull-Clark control mesh lie in, on every level.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/crease_masks.h"
#include "core/loop/crease_topology.h"

namespace rilievo {

// Refining the triangles refines the quads: the middle of a diagonal is the new vertex of its quad,
// and of the children those pair up again whose common edge is half a diagonal, or cuts off the
// corner opposite to one.
struct QuadLevel {
  std::vector<uint8_t> diagonal;  // by edge: 1 where it cuts a quad
  std::vector<float> sharpness;   // by edge, 0 where smooth and on the boundary
};

struct QuadRefinement {
  std::vector<QuadLevel> levels;  // of the levels with faces; none for a Loop surface
  std::vector<int> corners;       // ControlMesh::corners
  bool empty() const { return levels.empty(); }
};

// By edge: 1 for the diagonals; empty where there are none. INVALID_ARGUMENT unless they ascend and
// pair up all faces. `topology`: of the mesh.
absl::StatusOr<std::vector<uint8_t>> FlagsOfDiagonals(const ControlMesh& mesh,
                                                      const MeshTopology& topology);

// Empty where the mesh has no diagonals. `levels`: the refinement of its faces. INVALID_ARGUMENT
// as FlagsOfDiagonals and BuildCreaseTopology.
absl::StatusOr<QuadRefinement> RefineQuads(const ControlMesh& mesh,
                                           const std::vector<MeshTopology>& levels);

// The corners of a quad counter-clockwise; edges[i] joins vertices[i] and the one after.
struct Quad {
  std::array<int, 4> vertices, edges;
  int diagonal = -1;  // edge between vertices[0] and vertices[2]
  int PlaceOfEdge(int edge) const {
    int i = 0;
    while (edges[i] != edge) ++i;
    return i;
  }
};
Quad QuadOfFace(const MeshTopology& topology, const QuadLevel& quads, int face);

// All quads of a level, four corners each, from one end of the diagonal on: cut into fans they are
// the triangles again.
std::vector<int> CornersOfQuads(const MeshTopology& topology, const QuadLevel& quads);

// What surrounds a vertex, in the order of quad_masks.h.
struct QuadRing {
  std::vector<int> neighbors;        // along edges
  std::vector<int> opposite;         // corners of the quads
  SharpRing sharp;                   // of the edges
  std::vector<uint32_t> half_edges;  // of its triangles, counter-clockwise: 3 f + k, corner k of f
  std::vector<int> triangle;  // by edge: place in `half_edges` of the triangle that comes after it
};

// Asks for the rings of the vertices of a level. All is kept by reference.
class QuadRings {
 public:
  QuadRings(const MeshTopology& topology, const QuadRefinement& quads, int level);
  // Replaces what `ring` holds.
  void Of(int vertex, QuadRing& ring) const;

 private:
  // The next half-edge around the vertex that it leaves, or kNoHalfEdge on the boundary.
  uint32_t Turned(uint32_t half_edge) const;

  const MeshTopology& topology_;
  const QuadLevel& quads_;
  const std::vector<int>& corners_;
  std::vector<uint32_t> first_;  // half-edge that leaves each vertex; the boundary's where there is
};

// The ring of the new vertex on an edge, in the numbers of the next level: two to four neighbours
// along edges, then as many corners, or one less on the boundary.
struct NewQuadRing {
  std::array<int, 8> neighbors;
  int size = 0;
  bool boundary = false;
};
NewQuadRing RingOfNewVertex(const MeshTopology& parent, const QuadLevel& quads, int edge);

}  // namespace rilievo
