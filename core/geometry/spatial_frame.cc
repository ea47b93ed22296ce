#include "core/geometry/spatial_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/geometry/frame_limit.h"

namespace rilievo {
namespace {

// Largest half of a diagonal and |coordinate| of the centre: what rounding adds to the frame of a
// surface still fits a file.
constexpr double kMostLength = kMostFrameLength / 4;

}  // namespace

absl::StatusOr<SpatialFrame> BoundingFrame(const Eigen::Matrix3Xd& points,
                                           const std::vector<int>& columns) {
  Eigen::Vector3d low = points.col(columns.front());
  Eigen::Vector3d high = low;
  for (const int column : columns) {
    low = low.cwiseMin(points.col(column));
    high = high.cwiseMax(points.col(column));
  }
  const double half_diagonal = (high / 2 - low / 2).stableNorm();
  if (half_diagonal < std::numeric_limits<double>::min()) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: all ", columns.size(),
                     " finite points are identical; a surface needs distinct ones"));
  }
  const Eigen::Vector3d center = low / 2 + high / 2;
  const double farthest = std::max(half_diagonal, center.cwiseAbs().maxCoeff());
  if (!(farthest <= kMostLength)) {
    return absl::InvalidArgumentError(absl::StrCat("points: they reach ", farthest,
                                                   ", which is too large; at most ", kMostLength,
                                                   " is taken, give them in a larger unit"));
  }
  return SpatialFrame{low + (high - low) / 2, 2 * half_diagonal};
}

SpatialFrame Rounded(const SpatialFrame& frame) {
  constexpr int kDiagonalDigits = 21, kGrid = 10;
  int exponent = 0;
  std::frexp(frame.diagonal, &exponent);
  const auto rounded = [](double value, int digit) {
    const double result = std::ldexp(std::nearbyint(std::ldexp(value, -digit)), digit);
    return std::isfinite(result) ? result : value;  // too far out for that grid
  };
  SpatialFrame result;
  result.diagonal = rounded(frame.diagonal, exponent - kDiagonalDigits);
  for (int axis = 0; axis < 3; ++axis) {
    result.center[axis] = rounded(frame.center[axis], exponent - 1 - kGrid);
  }
  return result;
}

}  // namespace rilievo
