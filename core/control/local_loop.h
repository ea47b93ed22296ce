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
class LocalLoopFinder {
 public:
  LocalLoopFinder(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices);

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
  struct VertexEdges {
    std::vector<int> begin, edges;
  };
  std::span<const int> EdgesAt(int vertex) const {
    const int begin = vertex_edges_->begin[vertex];
    return {vertex_edges_->edges.data() + begin,
            static_cast<size_t>(vertex_edges_->begin[vertex + 1] - begin)};
  }
  void CollectFaces();
  int CapBoundary();  // numbers the boundary loops; returns how many
  int Handles(int boundary_loops);
  std::vector<int> ShortestTreeLoop();
  int FindSet(int element);

  const MeshTopology& topology_;
  const Eigen::Matrix3Xd& vertices_;
  std::shared_ptr<const VertexEdges> vertex_edges_;
  std::vector<double> distance_;  // per vertex, valid where stamped
  std::vector<int> parent_edge_, vertex_stamp_, counted_stamp_;
  std::vector<int> face_slot_, face_stamp_;  // per face, place in disc_faces_
  std::vector<int> edge_stamp_;
  std::vector<int> disc_vertices_, disc_faces_, disc_edges_;
  std::vector<int> boundary_set_;  // per edge of the disc's boundary, valid where on it
  std::vector<int> sets_;          // union-find over faces, then boundary loops
  int stamp_ = 0;
};

}  // namespace rilievo
