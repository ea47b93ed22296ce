// Short loops that do not separate the surface, searched in geodesic discs around seeds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/mesh_topology.h"

namespace rilievo {

// Searches one mesh; keeps its scratch from call to call, so each thread needs a copy of its own.
// Copies share what they know of the mesh, and take room for what they are asked for only.
class NonseparatingLoopFinder {
 public:
  NonseparatingLoopFinder(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices);

  // The shortest loop through `root` among those of the tree-cotree decomposition (Eppstein 2003;
  // Erickson and Whittlesey 2005) of the disc of geodesic radius `radius` around it, its boundary
  // loops capped. Vertices in order; empty when the disc has no handle.
  std::vector<int> LoopAround(int root, double radius);

  // The vertices within geodesic `radius` of `root`, nearest first. Valid until the next call.
  const std::vector<int>& Disc(int root, double radius);

  // The vertices that edges join to `root` within a ball of `radius` around it, in no order. Valid
  // until the next call.
  const std::vector<int>& Patch(int root, double radius);

  // Whether that patch has no handle, nor has any part of it: so no disc within has one.
  bool PatchIsFlat(int root, double radius);

  double Length(const std::vector<int>& loop) const;

 private:
  // What meets at each vertex, in lists one after the other. The lists hold edges, the vertices at
  // their other ends, and the faces whose first corner the vertex is.
  struct VertexTables {
    std::vector<int> edge_begin, edges, neighbors;
    std::vector<int> face_begin, faces;
  };
  static std::span<const int> ListOf(int vertex, const std::vector<int>& begin,
                                     const std::vector<int>& lists) {
    return {lists.data() + begin[vertex], lists.data() + begin[vertex + 1]};
  }
  std::span<const int> EdgesAt(int vertex) const {
    return ListOf(vertex, tables_->edge_begin, tables_->edges);
  }
  std::span<const int> NeighborsOf(int vertex) const {
    return ListOf(vertex, tables_->edge_begin, tables_->neighbors);
  }
  std::span<const int> FacesOf(int vertex) const {
    return ListOf(vertex, tables_->face_begin, tables_->faces);
  }
  void CollectFaces();
  void CollectEdges();
  int CapBoundary();  // numbers the boundary loops; returns how many
  static int Handles(int boundary_loops, int euler);
  std::vector<int> ShortestTreeLoop(int boundary_loops);
  int FindSet(int element);

  const MeshTopology& topology_;
  const Eigen::Matrix3Xd& vertices_;
  std::shared_ptr<const VertexTables> tables_;
  std::vector<double> distance_;  // per vertex, valid where stamped
  std::vector<int> parent_edge_, vertex_stamp_, counted_stamp_;
  std::vector<int> face_slot_, face_stamp_;  // per face, place in disc_faces_
  std::vector<int> rim_;  // of a patch: vertices with a neighbor out of it, or on the boundary
  std::vector<int> disc_vertices_, disc_faces_, disc_edges_, border_;  // of edges with one face
  int used_vertices_ = 0;                                              // those of the disc's edges
  std::vector<int> boundary_set_;  // per edge of the disc's boundary, valid where on it
  std::vector<int> sets_;          // union-find over faces, then boundary loops
  int stamp_ = 0;
};

}  // namespace rilievo
