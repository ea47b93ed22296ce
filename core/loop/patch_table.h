// Limit positions and tangents on one face as fixed weights of the control points around it.
#pragma once

#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "core/loop/patch_lattice.h"

namespace rilievo {

// x, y, z of the limit position, of tangent u, of tangent v (LimitStencils).
using PatchSample = std::array<double, 9>;

// A smooth face whose corner 0 has any interior valence, the others 6. Its surface depends on the
// n + 6 control points of the faces around it: the corners 0, 1, 2, then the outer ones as they
// come counter-clockwise around the corners 0, 1, 2, each once (see PatchRing).
class PatchTable {
 public:
  enum Group { kSide0, kSide1, kSide2, kInterior };

  static absl::StatusOr<PatchTable> Build(int valence, const PatchLattice& lattice);

  int ring_size() const { return ring_size_; }

  // Samples at the points of one group of the lattice. `ring`: ring_size() points. `samples`: one
  // per point of the lattice.
  void Evaluate(Group group, const std::vector<std::array<double, 3>>& ring,
                std::vector<PatchSample>& samples) const;

 private:
  // Weights of two points at a time, for each control point of the ring: position, u, v of both.
  struct Points {
    std::vector<int> points;  // an even number, the last perhaps twice
    std::vector<double> weights;
  };
  int ring_size_ = 0;
  std::array<Points, 4> groups_;
};

// The vertices around a face of the topology in the order of a PatchTable, corner `first` being its
// corner 0. All three corners are interior vertices of valence 3 or more.
void PatchRing(const MeshTopology& topology, int face, int first, std::vector<int>& ring);

}  // namespace rilievo
