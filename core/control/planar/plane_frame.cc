#include "core/control/planar/plane_frame.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/control/planar/sheet_test.h"

namespace rilievo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLargestSpacing = 4;    // of the median, for a point's area
constexpr double kFacingCosine = 0.174;  // 80 degrees
constexpr double kCellSpacings = 3;      // width of a cell
constexpr double kSheetGap = 2.5;        // cells between two sheets: a slope of 68 degrees has none

double FacingShare(const OrientedCloud& cloud, const Vector3d& direction) {
  double facing = 0, all = 0;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double area = PointArea(cloud, i);
    all += area;
    if (cloud.normals.col(i).dot(direction) > kFacingCosine) facing += area;
  }
  return all > 0 ? facing / all : 0;
}

Vector3d WithPositiveLargest(const Vector3d& axis) {
  int largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0 ? Vector3d(-axis) : axis;
}

}  // namespace

double PointArea(const OrientedCloud& cloud, int i) {
  const double spacing = std::min(double{cloud.spacing[i]}, kLargestSpacing * cloud.median_spacing);
  return std::numbers::pi / 4 * spacing * spacing;
}

PlaneFrame FitPlaneFrame(const OrientedCloud& cloud) {
  PlaneFrame frame;
  double area_sum = 0;
  Vector3d mean = Vector3d::Zero(), mean_normal = Vector3d::Zero();
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double area = PointArea(cloud, i);
    area_sum += area;
    mean += area * cloud.points.col(i);
    mean_normal += area * cloud.normals.col(i);
  }
  if (!(area_sum > 0)) return frame;
  frame.origin = mean / area_sum;
  Matrix3d covariance = Matrix3d::Zero();
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const Vector3d offset = cloud.points.col(i) - frame.origin;
    covariance += PointArea(cloud, i) * offset * offset.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(covariance);
  Vector3d normal = principal.eigenvectors().col(0);
  if (normal.dot(mean_normal) < 0) normal = -normal;
  if (mean_normal.norm() > 0.1 * area_sum) {
    const Vector3d candidate = mean_normal.normalized();
    if (FacingShare(cloud, candidate) > FacingShare(cloud, normal) + 0.01) normal = candidate;
  }
  const Matrix3d across = Matrix3d::Identity() - normal * normal.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> in_plane(across * covariance * across);
  const Vector3d longest = in_plane.eigenvectors().col(2);
  const Vector3d u = WithPositiveLargest((across * longest).normalized());
  frame.axes << u, normal.cross(u), normal;
  return frame;
}

absl::StatusOr<HeightFieldCheck> CheckHeightField(const OrientedCloud& cloud,
                                                  const PlaneFrame& frame,
                                                  const RunContext& context) {
  HeightFieldCheck check;
  check.facing = FacingShare(cloud, frame.axes.col(2));
  const double cell = std::max(kCellSpacings * cloud.median_spacing, 1e-4);
  struct Entry {
    int64_t cell;
    double height;
    bool operator<(const Entry& other) const {
      return cell != other.cell ? cell < other.cell : height < other.height;
    }
  };
  std::vector<Entry> entries(static_cast<size_t>(cloud.points.cols()));
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const Vector3d plane = frame.PlaneFromUnit(cloud.points.col(i));
    const auto column = static_cast<int64_t>(std::floor(plane.x() / cell));
    const auto row = static_cast<int64_t>(std::floor(plane.y() / cell));
    entries[i] = {column * (int64_t{1} << 31) + row, plane.z()};
  }
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<>(), context, &entries));
  std::vector<double> heights(entries.size());
  for (size_t i = 0; i < entries.size(); ++i) heights[i] = entries[i].height;
  int64_t cells = 0, split = 0;
  for (size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    for (end = begin; end < entries.size() && entries[end].cell == entries[begin].cell;) ++end;
    ++cells;
    split += HasTwoSheets({heights.data() + begin, end - begin}, kSheetGap * cell) ? 1 : 0;
  }
  check.single_sheet = cells > 0 ? 1 - static_cast<double>(split) / static_cast<double>(cells) : 0;
  return check;
}

}  // namespace rilievo
