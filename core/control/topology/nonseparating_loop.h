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

  // Marks the vertices of loops of which every loop of the component of `root` that does not
  // separate it, its boundary loops capped, crosses at least one: they are a basis of its first
  // homology, and no loop but a separating one meets each of them evenly often. Returns the
  // component.
  std::vector<int> MarkLoops(int root, std::vector<uint8_t>* marks);

  double Length(const std::vector<int>& loop) const;

 private:
  // What meets at each vertex, in lists one after the other: edges, and the faces whose first
  // corner the vertex is.
  struct VertexTables {
    std::vector<int> edge_begin, edges;
    std::vector<int> face_begin, faces;
  };
  static std::span<const int> ListOf(int vertex, const std::vector<int>& begin,
                                     const std::vector<int>& lists) {
    return {lists.data() + begin[vertex], lists.data() + begin[vertex + 1]};
  }
  std::span<const int> EdgesAt(int vertex) const {
    return ListOf(vertex, tables_->edge_begin, tables_->edges);
  }
  std::span<const int> FacesOf(int vertex) const {
    return ListOf(vertex, tables_->face_begin, tables_->faces);
  }
  void CollectFaces();
  void CollectEdges();
  // An edge that closes a loop through the root, and how long that is.
  struct LoopEdge {
    float length;
    int edge;
    auto operator<=>(const LoopEdge&) const = default;
  };

  bool IsInDisc(int face) const {
    const auto slot = static_cast<size_t>(face_slot_[face]);
    return slot < disc_faces_.size() && disc_faces_[slot] == face;
  }
  int CapBoundary();  // numbers the boundary loops; returns how many
  // Those off the tree of the last disc and off its cotree; none where it has no handle.
  std::vector<LoopEdge> LoopEdges();
  std::vector<int> TreeLoop(int closing_edge) const;

  const MeshTopology& topology_;
  const Eigen::Matrix3Xd& vertices_;
  std::shared_ptr<const VertexTables> tables_;
  std::vector<double> distance_;  // per vertex, valid where stamped
  std::vector<int> parent_edge_, vertex_stamp_, counted_stamp_;
  std::vector<int> face_slot_;  // per face, place in disc_faces_ where that holds it
  std::vector<int> disc_vertices_, disc_faces_, disc_edges_, border_;  // of edges with one face
  int used_vertices_ = 0;                                              // those of the disc's edges
  std::vector<int> boundary_set_;  // per edge of the disc's boundary, valid where on it
  int stamp_ = 0;
};

}  // namespace rilievo
