// Triangles in the frame of a voxel grid, quartered in parameter space.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/voxels/voxel_grid.h"

namespace rilievo {

// A triangle or a part of one: its corners, in voxels from the grid's origin.
using TrianglePiece = std::array<Eigen::Vector3d, 3>;

struct PieceBox {
  Eigen::Vector3d low, high;

  explicit PieceBox(const TrianglePiece& piece)
      : low(piece[0].cwiseMin(piece[1]).cwiseMin(piece[2])),
        high(piece[0].cwiseMax(piece[1]).cwiseMax(piece[2])) {}
  // Its longest side.
  double extent() const { return (high - low).maxCoeff(); }
};

inline TrianglePiece PieceOf(const TriangleMesh& mesh, Eigen::Index triangle,
                             const VoxelGrid& grid) {
  const auto corner = [&](int k) {
    return grid.LocalOf(mesh.vertices.col(mesh.triangles(k, triangle)));
  };
  return {corner(0), corner(1), corner(2)};
}

template <typename Visit>
void ForEachQuarter(const TrianglePiece& piece, const Visit& visit) {
  const Eigen::Vector3d ab = (piece[0] + piece[1]) / 2, bc = (piece[1] + piece[2]) / 2,
                        ca = (piece[2] + piece[0]) / 2;
  visit(TrianglePiece{piece[0], ab, ca});
  visit(TrianglePiece{ab, piece[1], bc});
  visit(TrianglePiece{ca, bc, piece[2]});
  visit(TrianglePiece{ab, bc, ca});
}

// Calls visit(piece, box) for pieces that make up `piece`, each of at most this extent.
template <typename Visit>
void ForEachPart(const TrianglePiece& piece, double extent, const Visit& visit) {
  const PieceBox box(piece);
  if (box.extent() <= extent) {
    visit(piece, box);
    return;
  }
  ForEachQuarter(piece, [&](const TrianglePiece& quarter) { ForEachPart(quarter, extent, visit); });
}

}  // namespace rilievo
