// Triangles in the frame of a voxel grid, halved in parameter space.
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

// Calls visit(piece, box) for pieces that make up `piece`, each of at most this extent.
template <typename Visit>
void ForEachPart(const TrianglePiece& piece, double extent, const Visit& visit) {
  const PieceBox box(piece);
  if (box.extent() <= extent) {
    visit(piece, box);
    return;
  }
  // Halves of the longest side keep needles few.
  size_t side = 0;  // from this corner to the next
  for (size_t k = 1; k < 3; ++k) {
    const auto length = [&](size_t from) {
      return (piece[(from + 1) % 3] - piece[from]).squaredNorm();
    };
    if (length(k) > length(side)) side = k;
  }
  const Eigen::Vector3d middle = (piece[side] + piece[(side + 1) % 3]) / 2;
  for (const size_t moved : {side, (side + 1) % 3}) {
    TrianglePiece half = piece;
    half[moved] = middle;
    ForEachPart(half, extent, visit);
  }
}

}  // namespace rilievo
