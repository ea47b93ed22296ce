#include "core/voxels/shell_voxels.h"

#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/voxels/triangle_box.h"
#include "core/voxels/triangle_pieces.h"

namespace rilievo {
namespace {

using Eigen::Vector3i;

// In voxels.
constexpr double kTestedExtent = 2;   // of a piece whose voxels are tested
constexpr double kSharedExtent = 64;  // of a triangle; larger ones are shared among the threads

void TestVoxels(const TrianglePiece& piece, const PieceBox& box, VoxelBits& shell) {
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

}  // namespace

absl::StatusOr<VoxelBits> ShellVoxels(const TriangleMesh& mesh, const VoxelGrid& grid,
                                      const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckInside(mesh, grid));
  VoxelBits shell(grid);
  const auto voxelize = [&shell](const TrianglePiece& whole) {
    ForEachPart(whole, kTestedExtent, [&shell](const TrianglePiece& piece, const PieceBox& box) {
      TestVoxels(piece, box, shell);
    });
  };
  const auto is_large = [](const TrianglePiece& piece) {
    return PieceBox(piece).extent() > kSharedExtent;
  };
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(mesh.triangles.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t t = begin; t < end; ++t) {
          const TrianglePiece piece = PieceOf(mesh, t, grid);
          if (!is_large(piece)) voxelize(piece);
        }
      }));
  std::vector<TrianglePiece> shares;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const TrianglePiece piece = PieceOf(mesh, t, grid);
    if (!is_large(piece)) continue;
    ForEachPart(piece, kSharedExtent, [&shares](const TrianglePiece& share, const PieceBox&) {
      shares.push_back(share);
    });
  }
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(shares.size()), 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) voxelize(shares[static_cast<size_t>(i)]);
      }));
  return shell;
}

}  // namespace rilievo
