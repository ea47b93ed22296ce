// Connectivity of a triangle list: edges, adjacency, boundary loops, Euler number, manifold checks.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

// The corners after and before corner k of a face.
inline constexpr std::array<int, 3> kNextCorner = {1, 2, 0}, kPreviousCorner = {2, 0, 1};

// Corner k of face f is faces(k, f); the half-edge of corner k runs from corner k to corner
// (k + 1) % 3. Edges are numbered in the order in which the half-edges (f = 0.., k = 0..2) first
// meet them, so the numbering depends on the face list alone.
struct MeshTopology {
  int vertex_count = 0;
  Eigen::Matrix3Xi faces;
  Eigen::Matrix3Xi face_edges;      // (k, f): edge under the half-edge of corner k
  Eigen::Matrix3Xi face_neighbors;  // (k, f): face across that edge, -1 on the boundary
  Eigen::Matrix2Xi edge_vertices;   // first < second
  Eigen::Matrix2Xi edge_faces;      // the face that met the edge first, and the other one or -1
  std::vector<uint8_t> boundary_vertex;  // 1 where a boundary edge ends
  std::vector<int> valence;              // edges at the vertex

  int face_count() const { return static_cast<int>(faces.cols()); }
  int edge_count() const { return static_cast<int>(edge_vertices.cols()); }
};

// Corner of `face` whose half-edge lies on `edge`, one of its three.
inline int CornerOfEdge(const MeshTopology& topology, int face, int edge) {
  return (topology.face_edges(1, face) == edge) + 2 * (topology.face_edges(2, face) == edge);
}

// INVALID_ARGUMENT that names the first offending face, edge or vertex unless `faces` is an
// orientable 2-manifold with or without boundary: at least one face, indices in range and distinct
// within a face, at most two faces an edge, opposite half-edges, no two faces over the same three
// vertices, one fan of faces a vertex, no unused vertex.
absl::StatusOr<MeshTopology> BuildMeshTopology(const Eigen::Matrix3Xi& faces, int vertex_count);

// Figures of a (possibly defective) triangle list. Counted are the faces of three different
// vertices within range, and the vertices those faces use. `genus` means something for manifolds
// only.
struct TopologySummary {
  int64_t vertices = 0, edges = 0, faces = 0;
  int64_t components = 0;
  int64_t boundary_loops = 0;  // of the manifold part
  int64_t boundary_edges = 0;
  int64_t nonmanifold_edges = 0;     // three faces or more
  int64_t nonmanifold_vertices = 0;  // more than one fan
  int64_t euler = 0;                 // V - E + F
  int64_t genus = 0;                 // sum over components, (2 C - boundary loops - euler) / 2
  bool oriented = true;              // no two faces run along an edge in the same direction
  bool closed() const { return boundary_edges == 0 && nonmanifold_edges == 0; }
  bool manifold() const { return nonmanifold_edges == 0 && nonmanifold_vertices == 0; }
};
TopologySummary SummarizeTopology(const Eigen::Matrix3Xi& faces, int vertex_count);

// Of a manifold: the sum over its components, as in its summary.
int64_t Genus(const MeshTopology& topology);

// Boundary loops, each a cycle of vertices in the direction of the faces' half-edges.
std::vector<std::vector<int>> BoundaryLoops(const MeshTopology& topology);

// Neighbours of each vertex in counter-clockwise order, as one flat table. At a boundary
// vertex the ring starts at the outgoing boundary half-edge, and has one neighbour more than faces.
struct VertexRings {
  std::vector<int> neighbor_begin;  // size vertex_count + 1
  std::vector<int>
      neighbors;  // neighbour vertices of v: [neighbor_begin[v], neighbor_begin[v + 1])
};
VertexRings BuildVertexRings(const MeshTopology& topology);

}  // namespace rilievo
