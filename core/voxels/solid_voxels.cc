#include "core/voxels/solid_voxels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/parallel_for.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"

namespace rilievo {
namespace {

using Wide = __int128;                         // holds products of three coordinates
using RoundedCorner = std::array<int64_t, 3>;  // 2^-20 of a voxel, from the grid's origin
constexpr int kVoxelBits = 20;
constexpr int64_t kHalfVoxel = int64_t{1} << (kVoxelBits - 1);

// Voxel `voxel` of row (y, z) is the first whose centre lies beyond a triangle. Ordered by row and
// voxel; the last bit says whether the triangle faces back along x, so that the row enters there.
using Crossing = uint64_t;

int64_t CenterAt(int64_t voxel) { return (voxel << kVoxelBits) + kHalfVoxel; }
// The first voxel whose centre is not before `at`.
int64_t FirstFrom(int64_t at) { return (at + kHalfVoxel - 1) >> kVoxelBits; }

// Of a row (y, z), on which side of the edge from p to q, seen along x: positive to the left. What
// is added breaks a tie as for a row moved by a little along y and by far less along z.
struct EdgeSide {
  int64_t y, z, along_y, along_z;
  bool left_on_tie;
  EdgeSide(const RoundedCorner& p, const RoundedCorner& q)
      : y(p[1]),
        z(p[2]),
        along_y(q[1] - p[1]),
        along_z(q[2] - p[2]),
        left_on_tie(along_z < 0 || (along_z == 0 && along_y > 0)) {}
  Wide At(int64_t row_y, int64_t row_z) const {
    return Wide{along_y} * (row_z - z) - Wide{along_z} * (row_y - y);
  }
  bool Left(Wide at) const { return left_on_tie ? at >= 0 : at > 0; }
};

Wide CeilOfQuotient(Wide value, Wide positive) {
  const Wide quotient = value / positive;
  return quotient * positive < value ? quotient + 1 : quotient;
}

// Where the triangle lies along y in the row at `row_z`, with a unit to spare for rounding.
std::pair<int64_t, int64_t> SpanAlongY(const std::array<RoundedCorner, 3>& corners, int64_t row_z) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (size_t k = 0; k < 3; ++k) {
    const RoundedCorner &p = corners[k], &q = corners[(k + 1) % 3];
    if (std::min(p[2], q[2]) > row_z || std::max(p[2], q[2]) < row_z) continue;
    const double share =
        p[2] == q[2] ? 0 : static_cast<double>(row_z - p[2]) / static_cast<double>(q[2] - p[2]);
    const double y = static_cast<double>(p[1]) + share * static_cast<double>(q[1] - p[1]);
    low = std::min(low, y);  // of a side along y both ends are those of other sides, too
    high = std::max(high, y);
  }
  return {static_cast<int64_t>(std::floor(low)) - 1, static_cast<int64_t>(std::ceil(high)) + 1};
}

void CollectCrossings(std::array<RoundedCorner, 3> corners, const VoxelGrid& grid,
                      std::vector<Crossing>* crossings) {
  const Wide double_area = EdgeSide(corners[0], corners[1]).At(corners[2][1], corners[2][2]);
  if (double_area == 0) return;  // a row that was moved a little misses it
  const bool enters = double_area < 0;
  if (enters) std::swap(corners[1], corners[2]);
  const Wide positive_area = enters ? -double_area : double_area;
  const EdgeSide sides[3] = {
      {corners[1], corners[2]}, {corners[2], corners[0]}, {corners[0], corners[1]}};
  const auto [low_z, high_z] = std::minmax({corners[0][2], corners[1][2], corners[2][2]});
  for (int64_t z = FirstFrom(low_z); CenterAt(z) <= high_z; ++z) {
    const auto [low_y, high_y] = SpanAlongY(corners, CenterAt(z));
    for (int64_t y = FirstFrom(low_y); CenterAt(y) <= high_y; ++y) {
      Wide weights[3];  // of the corners, times positive_area
      bool inside = true;
      for (size_t k = 0; k < 3 && inside; ++k) {
        weights[k] = sides[k].At(CenterAt(y), CenterAt(z));
        inside = sides[k].Left(weights[k]);
      }
      if (!inside) continue;
      const Wide along_x = weights[0] * corners[0][0] + weights[1] * corners[1][0] +
                           weights[2] * corners[2][0] - positive_area * kHalfVoxel;
      const auto voxel = static_cast<int64_t>(CeilOfQuotient(along_x, positive_area << kVoxelBits));
      const int64_t row = z * grid.size.y() + y;
      crossings->push_back(static_cast<Crossing>(row * (grid.size.x() + 1) + voxel) << 1 |
                           Crossing{enters});
    }
  }
}

std::vector<RoundedCorner> RoundVertices(const TriangleMesh& mesh, const VoxelGrid& grid) {
  std::vector<RoundedCorner> rounded(static_cast<size_t>(mesh.vertices.cols()));
  for (size_t v = 0; v < rounded.size(); ++v) {
    const Eigen::Vector3d local =
        grid.LocalOf(mesh.vertices.col(static_cast<Eigen::Index>(v))) * (1 << kVoxelBits);
    for (int axis = 0; axis < 3; ++axis) {
      rounded[v][static_cast<size_t>(axis)] = std::llround(local[axis]);
    }
  }
  return rounded;
}

absl::StatusOr<std::vector<Crossing>> AllCrossings(const TriangleMesh& mesh, const VoxelGrid& grid,
                                                   const RunContext& context) {
  const std::vector<RoundedCorner> rounded = RoundVertices(mesh, grid);
  const int64_t count = mesh.triangles.cols();
  // A few large triangles cross as many rows as thousands of small ones.
  const int64_t block = std::clamp<int64_t>(count / 256, 1, kSearchBlock);
  std::vector<std::vector<Crossing>> of_block(static_cast<size_t>((count + block - 1) / block));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, block, context, [&](int64_t begin, int64_t end) {
    const auto corner = [&](int k, int64_t t) {
      return rounded[static_cast<size_t>(mesh.triangles(k, t))];
    };
    for (int64_t t = begin; t < end; ++t) {
      CollectCrossings({corner(0, t), corner(1, t), corner(2, t)}, grid,
                       &of_block[static_cast<size_t>(begin / block)]);
    }
  }));
  std::vector<Crossing> crossings;
  for (std::vector<Crossing>& found : of_block) {
    crossings.insert(crossings.end(), found.begin(), found.end());
    FreeMemoryOf(&found);
  }
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<>(), context, &crossings));
  return crossings;
}

}  // namespace

bool EnclosesVolume(const TriangleMesh& mesh) {
  Eigen::Matrix3Xi faces(3, mesh.triangles.cols());
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto corners = mesh.triangles.col(t);
    const bool folded =
        corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
    if (!folded) faces.col(kept++) = corners;
  }
  faces.conservativeResize(3, kept);
  bool balanced = kept > 0;
  ForEachEdge(faces, static_cast<int>(mesh.vertices.cols()),
              [&](int low, int, const HalfEdgeGroup& group) {
                int64_t sum = 0;
                for (size_t i = 0; i < group.size(); ++i) {
                  sum += Origin(faces, group[i]) == low ? 1 : -1;
                }
                balanced = balanced && sum == 0;
              });
  return balanced;
}

absl::StatusOr<VoxelBits> SolidVoxels(const TriangleMesh& mesh, const VoxelGrid& grid,
                                      const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckInside(mesh, grid));
  if (!EnclosesVolume(mesh)) {
    return absl::FailedPreconditionError(
        "the surface is open, so no voxel is inside of it; make a shell, or close the surface "
        "(reconstruct with --boundary close)");
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<Crossing> crossings,
                           AllCrossings(mesh, grid, context));
  VoxelBits solid(grid);
  const int64_t ends = grid.size.x() + 1;  // one more than voxels: beyond the last
  int64_t winding = 0, before = 0, row_before = -1;
  for (const Crossing crossing : crossings) {
    const auto place = static_cast<int64_t>(crossing >> 1);
    const int64_t row = place / ends, voxel = row * grid.size.x() + place % ends;
    if (row != row_before) winding = 0;
    if (winding != 0) solid.SetRun(before, voxel);
    winding += (crossing & 1) != 0 ? 1 : -1;
    before = voxel;
    row_before = row;
  }
  return solid;
}

}  // namespace rilievo
