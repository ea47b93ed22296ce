// The vertices that uniform refinement puts on one face, and the order in which it numbers them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/geometry/mesh_topology.h"

namespace rilievo {

// The points i, j >= 0, i + j <= n of a face refined `steps` times, n = 2^steps, in rows of j; with
// corner 0 at (0, 0), corner 1 at (n, 0), corner 2 at (0, n).
class PatchLattice {
 public:
  explicit PatchLattice(int steps);  // [1, 8]

  int steps() const { return steps_; }
  int n() const { return n_; }
  int point_count() const { return (n_ + 1) * (n_ + 2) / 2; }
  int PointAt(int i, int j) const { return j * (n_ + 1) - j * (j - 1) / 2 + i; }
  const std::array<int, 3>& corners() const { return corners_; }
  // The n - 1 points inside side s, from corner s to corner s + 1.
  const std::array<std::vector<int>, 3>& sides() const { return sides_; }
  const std::vector<int>& interior() const { return interior_; }
  // The 4^steps faces in the order of LoopRefinement. Column = lattice points.
  const Eigen::Matrix3Xi& triangles() const { return triangles_; }
  // Where each point goes when corner 0 is turned onto corner `corner`.
  const std::vector<int>& Turned(int corner) const { return turned_[corner]; }

  // The points that step t of the refinement adds on a face which numbers the sides of `mask` (bit
  // s), in the order of LoopRefinement's vertices.
  const std::vector<int>& Added(int mask, int step) const { return added_[mask][step]; }
  // The same for those on side s, from corner s to corner s + 1: the step and the place in Added().
  struct Place {
    int step, rank;
  };
  const std::vector<Place>& SidePlaces(int mask, int side) const { return places_[mask][side]; }

 private:
  void AddPoints(int mask);

  int steps_, n_;
  std::array<int, 3> corners_;
  std::array<std::vector<int>, 3> sides_;
  std::vector<int> interior_;
  Eigen::Matrix3Xi triangles_;
  std::array<std::vector<int>, 3> turned_;
  std::array<std::vector<std::vector<int>>, 8> added_;
  std::array<std::array<std::vector<Place>, 3>, 8> places_;
};

// The vertices of LoopRefinement::levels[l + steps] on the faces of level l, from the topology of
// level l alone: those that a step adds on one face have successive numbers.
class PatchNumbering {
 public:
  // Both are kept by reference.
  PatchNumbering(const MeshTopology& topology, const PatchLattice& lattice);

  const PatchLattice& lattice() const { return lattice_; }
  int vertex_count() const { return first_.back(); }
  // Bit s: the face numbers the vertices on its side s.
  int MaskOf(int face) const { return masks_[face]; }
  // Vertex of the first point that `step` adds on this face.
  int FirstAdded(int face, int step) const {
    return first_[step] + face * interior_[step] + (first_edge_[face] << step);
  }
  // The vertex of each of its lattice points.
  void VerticesOf(int face, std::vector<int>& vertices) const;

 private:
  const MeshTopology& topology_;
  const PatchLattice& lattice_;
  std::vector<int> first_;     // vertices before step t; the last: all
  std::vector<int> interior_;  // points that step t adds inside a face
  std::vector<int> first_edge_;
  std::vector<uint8_t> masks_;
};

}  // namespace rilievo
