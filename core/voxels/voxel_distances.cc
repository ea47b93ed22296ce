#include "core/voxels/voxel_distances.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/surface/triangle_distance.h"
#include "core/voxels/solid_voxels.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kMeasuredExtent = 16;  // voxels, of a piece; the box of a larger one is emptier

// The voxels along one axis whose centres lie within `band` of [low, high], of `size`.
std::pair<int, int> VoxelsNear(double low, double high, int band, int size) {
  return {std::max(0, static_cast<int>(std::ceil(low - band - 0.5))),
          std::min(size, static_cast<int>(std::floor(high + band - 0.5)) + 1)};
}

// Unit; 0 of slivers, whose cross product is mostly rounding.
Vector3d NormalOf(const TrianglePiece& piece) {
  const Vector3d ab = piece[1] - piece[0], ac = piece[2] - piece[0];
  const Vector3d cross = ab.cross(ac);
  const double norm = cross.norm();
  if (norm <= 1e-8 * ab.norm() * ac.norm()) return Vector3d::Zero();
  return cross / norm;
}

}  // namespace

absl::StatusOr<VoxelDistances> VoxelDistances::Build(const TriangleMesh& mesh,
                                                     const VoxelGrid& grid, int band,
                                                     const RunContext& context) {
  if (band < 1 || band > kMaxBand) {
    return absl::InvalidArgumentError(
        absl::StrCat("band ", band, ": must be from 1 to ", kMaxBand));
  }
  RILIEVO_RETURN_IF_ERROR(CheckInside(mesh, grid));
  VoxelDistances made;
  made.grid_ = grid;
  made.band_ = band;
  std::vector<std::pair<int, int>> slabs;  // of each piece, those it is near
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    ForEachPart(PieceOf(mesh, t, grid), kMeasuredExtent,
                [&](const TrianglePiece& piece, const PieceBox& box) {
                  made.pieces_.push_back(piece);
                  const auto [first, end] =
                      VoxelsNear(box.low.z(), box.high.z(), band, grid.size.z());
                  slabs.emplace_back(first / kSlab, (end + kSlab - 1) / kSlab);
                });
  }
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  made.near_begin_.assign(static_cast<size_t>((grid.size.z() + kSlab - 1) / kSlab + 1), 0);
  for (const auto& [first, end] : slabs) {
    for (int s = first; s < end; ++s) ++made.near_begin_[static_cast<size_t>(s) + 1];
  }
  for (size_t s = 1; s < made.near_begin_.size(); ++s)
    made.near_begin_[s] += made.near_begin_[s - 1];
  made.near_.resize(static_cast<size_t>(made.near_begin_.back()));
  std::vector<int64_t> next = made.near_begin_;
  for (size_t i = 0; i < slabs.size(); ++i) {
    for (int s = slabs[i].first; s < slabs[i].second; ++s) {
      made.near_[static_cast<size_t>(next[static_cast<size_t>(s)]++)] = static_cast<int>(i);
    }
  }
  if (EnclosesVolume(mesh)) {
    RILIEVO_ASSIGN_OR_RETURN(made.solid_, SolidVoxels(mesh, grid, context));
  }
  return made;
}

absl::StatusOr<std::vector<float>> VoxelDistances::Layers(int first, int count,
                                                          const RunContext& context) const {
  if (first < 0 || count < 0 || first + count > grid_.size.z()) {
    return absl::InvalidArgumentError(absl::StrCat("layers ", first, " to ", first + count,
                                                   ": must be from 0 to ", grid_.size.z()));
  }
  const int64_t offset = grid_.Index(0, 0, first);
  std::vector<float> layers(static_cast<size_t>(grid_.Index(0, 0, first + count) - offset));
  const int first_slab = first / kSlab, last_slab = (first + count + kSlab - 1) / kSlab;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(last_slab - first_slab, 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t slab = begin; slab < end; ++slab) {
          const int z = (first_slab + static_cast<int>(slab)) * kSlab;
          const int from = std::max(z, first), to = std::min(z + kSlab, first + count);
          MeasureSlab(from, to, layers.data() + (grid_.Index(0, 0, from) - offset));
        }
      }));
  return layers;
}

void VoxelDistances::MeasureSlab(int first, int end, float* values) const {
  const int64_t begin = grid_.Index(0, 0, first), count = grid_.Index(0, 0, end) - begin;
  const auto beyond = static_cast<float>(band_ * band_);
  std::fill(values, values + count, beyond);
  const auto slab = static_cast<size_t>(first / kSlab);
  for (int64_t i = near_begin_[slab]; i < near_begin_[slab + 1]; ++i) {
    const int piece = near_[static_cast<size_t>(i)];
    MeasurePiece(pieces_[static_cast<size_t>(piece)], first, end, values);
  }
  for (int64_t i = 0; i < count; ++i) {
    const double distance =
        values[i] < beyond ? std::sqrt(double{values[i]}) * grid_.voxel : band();
    values[i] = static_cast<float>(solid_ && solid_->At(begin + i) ? -distance : distance);
  }
}

void VoxelDistances::MeasurePiece(const TrianglePiece& piece, int first, int end,
                                  float* squared) const {
  const PieceBox box(piece);
  Vector3i from, to;
  for (int axis = 0; axis < 3; ++axis) {
    std::tie(from[axis], to[axis]) =
        VoxelsNear(box.low[axis], box.high[axis], band_, grid_.size[axis]);
  }
  from.z() = std::max(from.z(), first);
  to.z() = std::min(to.z(), end);
  const Vector3d normal = NormalOf(piece);
  const double offset = normal.dot(piece[0]);
  for (int z = from.z(); z < to.z(); ++z) {
    for (int y = from.y(); y < to.y(); ++y) {
      float* row = squared + grid_.Index(0, y, z - first);
      for (int x = from.x(); x < to.x(); ++x) {
        const Vector3d center(x + 0.5, y + 0.5, z + 0.5);
        const double above = normal.dot(center) - offset;  // the triangle is no nearer
        if (above * above >= row[x]) continue;
        const auto distance =
            static_cast<float>(SquaredDistanceToTriangle(center, piece[0], piece[1], piece[2]));
        row[x] = std::min(row[x], distance);
      }
    }
  }
}

double VolumeInside(std::span<const float> distances, double voxel) {
  double voxels = 0;
  for (const float distance : distances) voxels += std::clamp(0.5 - distance / voxel, 0.0, 1.0);
  return voxels * voxel * voxel * voxel;
}

}  // namespace rilievo
