// What one point touches on the grid of an implicit function.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace rilievo {

// Trilinear weights of the 8 lattice points around a position given in lattice units.
struct Trilinear {
  Eigen::Vector3i base;
  std::array<float, 8> weight;
  explicit Trilinear(const Eigen::Vector3d& position) {
    const Eigen::Vector3d floor = position.array().floor();
    base = floor.cast<int>();
    const Eigen::Vector3d t = position - floor;
    for (int corner = 0; corner < 8; ++corner) {
      double w = 1;
      for (int axis = 0; axis < 3; ++axis) w *= ((corner >> axis) & 1) ? t[axis] : 1 - t[axis];
      weight[corner] = static_cast<float>(w);
    }
  }
};

// The nodes around a point, found at once: all that its own value and its flux touch.
struct NodesAround {
  Eigen::Vector3i low;
  std::array<int, 27> nodes;

  // `at`: in lattice units.
  static Eigen::Vector3i LowFor(const Eigen::Vector3d& at) {
    return (at.array() - 0.5).floor().cast<int>();
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
