#include "core/control/planar/plane_frame.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/control/planar/settings.h"
#include "core/control/planar/sheet_test.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double FacingShare(const OrientedCloud& cloud, const Vector3d& direction) {
  double facing = 0, all = 0;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double area = PointArea(cloud, i);
    all += area;
    if (cloud.normals.col(i).dot(direction) > kPlaneFrame.facing_cosine) facing += area;
  }
  return all > 0 ? facing / all : 0;
}

Vector3d WithPositiveLargest(const Vector3d& axis) {
  int largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0 ? Vector3d(-axis) : axis;
}

// The heights of the points, by square cell of the plane.
struct CellHeights {
  struct Cell {
    int64_t key;
    size_t begin, end;
  };
  std::vector<double> heights;  // ascending within each cell
  std::vector<Cell> cells;      // ascending by key

  std::span<const double> Of(const Cell& cell) const {
    return std::span(heights).subspan(cell.begin, cell.end - cell.begin);
  }
};

// From a cell to those beside it.
constexpr int64_t kColumnStride = int64_t{1} << 31, kRowStride = 1;

absl::StatusOr<CellHeights> HeightsByCell(const OrientedCloud& cloud, const PlaneFrame& frame,
                                          double width, const RunContext& context) {
  std::vector<std::pair<int64_t, double>> entries(static_cast<size_t>(cloud.points.cols()));
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const Vector3d plane = frame.PlaneFromUnit(cloud.points.col(i));
    const auto column = static_cast<int64_t>(std::floor(plane.x() / width));
    const auto row = static_cast<int64_t>(std::floor(plane.y() / width));
    entries[i] = {column * kColumnStride + row * kRowStride, plane.z()};
  }
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<>(), context, &entries));
  CellHeights by_cell;
  by_cell.heights.reserve(entries.size());
  for (size_t i = 0; i < entries.size(); ++i) {
    by_cell.heights.push_back(entries[i].second);
    if (i == 0 || entries[i].first != entries[i - 1].first) {
      by_cell.cells.push_back({entries[i].first, i, i});
    }
    by_cell.cells.back().end = i + 1;
  }
  return by_cell;
}

// The heights at which each cell breaks from those it would be joined to, or itself, as far as they
// are more than `gap` for each cell between, summed. A wall is met from two cells: half of that.
double BreaksBetweenCells(const CellHeights& by_cell, double gap) {
  double sum = 0;
  std::vector<double> heights;
  for (const CellHeights::Cell& cell : by_cell.cells) {
    heights.assign(by_cell.Of(cell).begin(), by_cell.Of(cell).end());
    int farthest = 1;
    for (const int64_t step : {kColumnStride, kRowStride}) {
      for (int apart = 1; apart <= kPlaneFrame.joined_cells; ++apart) {
        const int64_t key = cell.key + apart * step;
        const auto beside =
            std::ranges::lower_bound(by_cell.cells, key, {}, &CellHeights::Cell::key);
        if (beside == by_cell.cells.end() || beside->key != key) continue;
        heights.insert(heights.end(), by_cell.Of(*beside).begin(), by_cell.Of(*beside).end());
        farthest = std::max(farthest, apart);
        break;
      }
    }
    std::sort(heights.begin(), heights.end());
    const double widest = SheetGap(heights);
    if (widest > gap * farthest) sum += widest;
  }
  return sum / 2;
}

}  // namespace

double PointArea(const OrientedCloud& cloud, int i) {
  const double spacing =
      std::min(double{cloud.spacing[i]}, kPlaneFrame.widest_spacing * cloud.median_spacing);
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
  const double width = std::max(kCommon.gap_spacings * cloud.median_spacing, 1e-4);
  const double gap = kSheetTest.sheet_gap * width;
  RILIEVO_ASSIGN_OR_RETURN(const CellHeights by_cell, HeightsByCell(cloud, frame, width, context));
  if (by_cell.cells.empty()) return check;
  const auto cells = static_cast<double>(by_cell.cells.size());
  const auto split = std::ranges::count_if(by_cell.cells, [&](const CellHeights::Cell& cell) {
    return HasTwoSheets(by_cell.Of(cell), gap);
  });
  check.single_sheet = 1 - static_cast<double>(split) / cells;
  check.unseen_walls = BreaksBetweenCells(by_cell, gap) / (cells * width);
  return check;
}

}  // namespace rilievo
