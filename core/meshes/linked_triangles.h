// Triangles on their way to a manifold: which of them hang together.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/half_edges.h"

namespace rilievo {

// Triangles that hang together across edges. Half-edges as in half_edges.h.
struct LinkedTriangles {
  Eigen::Matrix3Xd vertices;  // unit frame
  Eigen::Matrix3Xi faces;
  std::vector<uint32_t> partner;  // by half-edge: the one across, or kNoHalfEdge
  int64_t opened = 0, flipped = 0;

  void Link(uint32_t a, uint32_t b) {
    partner[a] = b;
    partner[b] = a;
  }
  void Open(uint32_t h) {
    partner[partner[h]] = kNoHalfEdge;
    partner[h] = kNoHalfEdge;
  }
  double DoubleArea(int face) const {
    const Eigen::Vector3d origin = vertices.col(faces(0, face));
    return (vertices.col(faces(1, face)) - origin)
        .cross(vertices.col(faces(2, face)) - origin)
        .norm();
  }
};

// Links the triangles of each edge that has two, whichever way they run.
void LinkPairs(LinkedTriangles* mesh);

// All triangles of a piece face the same side; where a piece meets itself with the other side it is
// opened. Pieces without area are taken out.
absl::Status OrientPieces(const RunContext& context, LinkedTriangles* mesh);

// Where more than two triangles meet, the two around each wedge of a solid are linked, inner wedges
// first, as brackets are matched.
void LinkWedges(LinkedTriangles* mesh);

// Corners are one vertex where triangles hang together around them, so fans that only touch get
// vertices of their own. Returns by vertex the column of `mesh->vertices` that it was.
std::vector<int> SeparateFans(LinkedTriangles* mesh);

// A manifold has one edge between two vertices: others get a vertex in their middle. A round splits
// a triangle once; seldom a second is needed. `place`: what SeparateFans() returned; grows along.
void SplitRepeatedEdges(LinkedTriangles* mesh, std::vector<int>* place);

}  // namespace rilievo
