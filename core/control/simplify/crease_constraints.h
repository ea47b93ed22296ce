// The creases of a control mesh while its edges collapse and its vertices slide.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/control/simplify/half_edge_mesh.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// What the creases leave a vertex to do, in the order in which one takes over another. Where a
// crease ends, meets another one or the boundary, or changes its sharpness, its vertex is held.
enum class VertexConstraint : uint8_t { kAnywhere, kAlongCrease, kHeld, kHeldCorner };

// Tags by the ids of a half-edge mesh, which each call is given as it stands. Threads may work side
// by side wherever they may on that mesh.
class CreaseConstraints {
 public:
  // `tagged`: the mesh that `mesh` was built from; its tags are edges and vertices of it.
  CreaseConstraints(const HalfEdgeMesh& mesh, const ControlMesh& tagged);

  VertexConstraint ConstraintOf(int vertex) const { return constraint_[vertex]; }
  bool IsSharp(int edge) const { return sharpness_[edge] > 0; }

  // Whether the edge of h may collapse: a crease shortens edge by edge between its ends, a vertex
  // beside one may go into it, but for one of the boundary, and no two of them merge.
  bool Allow(const HalfEdgeMesh& mesh, int h) const;

  // Whether no crease turns by more than 60 degrees in a vertex, or by more than it did there, once
  // the ends of h meet at `position`: its limit leaves its control polygon by a sixth of what two
  // edges turn, so one of straight parts and arcs needs some vertices at each arc. `positions`: by
  // vertex.
  bool KeepTurns(const HalfEdgeMesh& mesh, const std::vector<Eigen::Vector3d>& positions, int h,
                 const Eigen::Vector3d& position) const;

  // Before To(h) collapses into From(h).
  void Merge(const HalfEdgeMesh& mesh, int h);

  // The creases and corners that are left, in terms of `renumbered` vertices (-1: gone).
  void Tag(const HalfEdgeMesh& mesh, const std::vector<int>& renumbered, ControlMesh* result) const;

 private:
  // The edge and the vertex after `edge` on the crease through `vertex`; -1 where it does not run
  // on.
  std::pair<int, int> Next(const HalfEdgeMesh& mesh, int vertex, int edge) const;

  std::vector<VertexConstraint> constraint_;  // per vertex
  std::vector<float> sharpness_;              // per edge, 0 where it is smooth
};

}  // namespace rilievo
