#include "core/voxels/shell_voxels.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/voxels/triangle_box.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kTestedExtent = 2;   // voxels, of a piece whose voxels are tested
constexpr double kPartedExtent = 64;  // of a piece that one thread takes at once

using Corners = std::array<Vector3d, 3>;  // in voxels from the grid's origin

struct PieceBox {
  Vector3d low, high;
  explicit PieceBox(const Corners& piece)
      : low(piece[0].cwiseMin(piece[1]).cwiseMin(piece[2])),
        high(piece[0].cwiseMax(piece[1]).cwiseMax(piece[2])) {}
  double extent() const { return (high - low).maxCoeff(); }
};

template <typename Visit>
void ForEachQuarter(const Corners& piece, const Visit& visit) {
  const Vector3d ab = (piece[0] + piece[1]) / 2, bc = (piece[1] + piece[2]) / 2,
                 ca = (piece[2] + piece[0]) / 2;
  visit(Corners{piece[0], ab, ca});
  visit(Corners{ab, piece[1], bc});
  visit(Corners{ca, bc, piece[2]});
  visit(Corners{ab, bc, ca});
}

void TestVoxels(const Corners& piece, const PieceBox& box, VoxelBits& shell) {
  const Vector3i first = ((box.low.array() - kVoxelSlack).ceil() - 1).cast<int>();
  const Vector3i last = (box.high.array() + kVoxelSlack).floor().cast<int>();
  if (first == last) {
    const int64_t index = shell.grid.Index(first.x(), first.y(), first.z());
    if (!shell.AtShared(index)) shell.SetShared(index);
    return;
  }
  const TriangleBoxTest test(piece[0], piece[1], piece[2]);
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      const int64_t row = shell.grid.Index(0, y, z);
      for (int x = first.x(); x <= last.x(); ++x) {
        if (shell.AtShared(row + x)) continue;
        if (test.Meets(x + 0.5, y + 0.5, z + 0.5)) shell.SetShared(row + x);
      }
    }
  }
}

void Voxelize(const Corners& piece, VoxelBits& shell) {
  const PieceBox box(piece);
  if (box.extent() <= kTestedExtent) return TestVoxels(piece, box, shell);
  ForEachQuarter(piece, [&](const Corners& quarter) { Voxelize(quarter, shell); });
}

// Appends `piece` in parts that one thread takes at once.
void Part(const Corners& piece, std::vector<Corners>* parts) {
  if (PieceBox(piece).extent() <= kPartedExtent) {
    parts->push_back(piece);
    return;
  }
  ForEachQuarter(piece, [&](const Corners& quarter) { Part(quarter, parts); });
}

}  // namespace

absl::StatusOr<VoxelBits> ShellVoxels(const TriangleMesh& mesh, const VoxelGrid& grid,
                                      const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckInside(mesh, grid));
  const auto corners_of = [&](Eigen::Index t) {
    Corners corners;
    for (int k = 0; k < 3; ++k) {
      corners[static_cast<size_t>(k)] = grid.LocalOf(mesh.vertices.col(mesh.triangles(k, t)));
    }
    return corners;
  };
  const auto is_large = [](const Corners& piece) {
    return PieceBox(piece).extent() > kPartedExtent;
  };
  VoxelBits shell(grid);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(mesh.triangles.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t t = begin; t < end; ++t) {
          const Corners piece = corners_of(t);
          if (!is_large(piece)) Voxelize(piece, shell);
        }
      }));
  std::vector<Corners> parts;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Corners piece = corners_of(t);
    if (is_large(piece)) Part(piece, &parts);
  }
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(parts.size()), 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) Voxelize(parts[static_cast<size_t>(i)], shell);
      }));
  return shell;
}

}  // namespace rilievo
