// What one point touches on the grid of an implicit function.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "core/control/implicit/sparse_grid.h"

namespace rilievo {

// The largest integer not above `value`, which an int must hold. std::floor calls a library routine
// on plain x86-64.
inline int FloorToInt(double value) {
  const int toward_zero = static_cast<int>(value);
  return toward_zero - (value < toward_zero ? 1 : 0);
}

// Trilinear weights of the 8 lattice points around a position given in lattice units.
struct Trilinear {
  Eigen::Vector3i base;
  std::array<float, 8> weight;
  explicit Trilinear(const Eigen::Vector3d& position) {
    Eigen::Vector3d t;
    for (int axis = 0; axis < 3; ++axis) {
      base[axis] = FloorToInt(position[axis]);
      t[axis] = position[axis] - base[axis];
    }
    const Eigen::Vector3d s = 1 - t.array();
    const std::array<double, 4> across{s.x() * s.y(), t.x() * s.y(), s.x() * t.y(), t.x() * t.y()};
    for (int k = 0; k < 4; ++k) {
      weight[k] = static_cast<float>(across[k] * s.z());
      weight[k + 4] = static_cast<float>(across[k] * t.z());
    }
  }
};

// The nodes around a point, found at once: all that its own value and its flux touch.
struct NodesAround {
  Eigen::Vector3i low = Eigen::Vector3i::Constant(std::numeric_limits<int>::min());  // of none yet
  std::array<int, 27> nodes;

  // To those around `at`, in lattice units. Places that follow each other along a Morton curve
  // often have the same, which are not looked up again.
  void MoveTo(const Eigen::Vector3d& at, SparseGridReader* grid) {
    const Eigen::Vector3i low_there = LowFor(at);
    if (low_there == low) return;
    low = low_there;
    grid->FindThreeCubed(low, &nodes);
  }

  // `at`: in lattice units.
  static Eigen::Vector3i LowFor(const Eigen::Vector3d& at) {
    return {FloorToInt(at.x() - 0.5), FloorToInt(at.y() - 0.5), FloorToInt(at.z() - 0.5)};
  }

  // Whether all corners of the cell with this lower corner are among them.
  bool Holds(const Eigen::Vector3i& base) const {
    const Eigen::Vector3i from = base - low;
    return ((from.x() | from.y() | from.z()) & ~1) == 0;
  }

  // The corners of the cell that a position, moved half a cell down one axis at most, lies in.
  std::array<int, 8> Cell(const Eigen::Vector3i& base) const {
    const Eigen::Vector3i from = base - low;
    const int first = from.x() + 3 * from.y() + 9 * from.z();
    return {nodes[first],     nodes[first + 1],  nodes[first + 3],  nodes[first + 4],
            nodes[first + 9], nodes[first + 10], nodes[first + 12], nodes[first + 13]};
  }
};

// Offsets that cover the disc of this radius (in cells) across the unit `normal`, about one a cell:
// a point that stands for more than a cell spreads over the surface and not across it, so that
// sheets closer than the spacing of their points stay apart.
void TangentDisc(const Eigen::Vector3d& normal, double radius, std::vector<Eigen::Vector3d>* disc);

}  // namespace rilievo
