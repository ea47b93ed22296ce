#include "core/scan/clean/check_scan.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/points/morton_order.h"
#include "core/scan/clean/settings.h"

namespace rilievo {
namespace {

struct Columns {
  std::vector<int> kept;
  int64_t dropped = 0;
};

Columns FiniteColumns(const Eigen::Matrix3Xd& points) {
  Columns result;
  result.kept.reserve(static_cast<size_t>(points.cols()));
  for (int i = 0; i < points.cols(); ++i) {
    if (points.col(i).allFinite()) {
      result.kept.push_back(i);
    } else {
      ++result.dropped;
    }
  }
  return result;
}

// The points within the limit of strays.
absl::StatusOr<Columns> DropStrays(const Eigen::Matrix3Xd& points, std::vector<int> columns,
                                   const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d limit, StrayLimit(points, columns, context));
  const size_t before = columns.size();
  std::erase_if(columns, [&](int column) { return !limit.contains(points.col(column)); });
  const auto dropped = static_cast<int64_t>(before - columns.size());
  return Columns{std::move(columns), dropped};
}

// The cells that a ball of radius `distance` around a point touches are runs of the sorted codes,
// at a level where a cell is at most 8 of it wide (or the finest there is).
class BallCells {
 public:
  explicit BallCells(double distance) : distance_(distance) {
    const double finest = std::ldexp(1.0, -kMortonBits);
    while (level_ < kMortonBits && std::ldexp(finest, level_) < 4 * distance) ++level_;
  }

  uint64_t CellOf(uint64_t code) const { return code >> (3 * level_); }

  // Whether holds(cell) for any cell of the ball.
  template <typename Holds>
  bool Any(const Eigen::Vector3d& point, const Holds& holds) const {
    uint32_t low[3], high[3];
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = MortonCell(point[axis] - distance_) >> level_;
      high[axis] = MortonCell(point[axis] + distance_) >> level_;
    }
    for (uint32_t z = low[2]; z <= high[2]; ++z) {
      for (uint32_t y = low[1]; y <= high[1]; ++y) {
        for (uint32_t x = low[0]; x <= high[0]; ++x) {
          if (holds(MortonCode(x, y, z))) return true;
        }
      }
    }
    return false;
  }

  bool AreSame(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    const double separation = (a - b).norm();
    return separation == 0 || separation < distance_;
  }

 private:
  double distance_;
  int level_ = 0;
};

// By place on the curve, 1 where another point is too near.
absl::StatusOr<std::vector<uint8_t>> PlacesWithCompany(const Eigen::Matrix3Xd& points,
                                                       const MortonOrder& morton,
                                                       const BallCells& cells,
                                                       const RunContext& context) {
  const auto count = static_cast<int64_t>(morton.order.size());
  std::vector<uint8_t> company(morton.order.size());
  const auto has_company = [&](int64_t place) {
    const Eigen::Vector3d point = points.col(morton.order[place]);
    const auto is_near = [&](int64_t other) {
      return cells.AreSame(points.col(morton.order[other]), point);
    };
    return cells.Any(point, [&](uint64_t cell) {
      int64_t from = place;  // mostly the cell of the place itself
      if (cells.CellOf(morton.codes[place]) != cell) {
        const auto first =
            std::partition_point(morton.codes.begin(), morton.codes.end(),
                                 [&](uint64_t code) { return cells.CellOf(code) < cell; });
        from = first - morton.codes.begin() - 1;
      }
      const auto in_cell = [&](int64_t other) { return cells.CellOf(morton.codes[other]) == cell; };
      for (int64_t other = from - 1; other >= 0 && in_cell(other); --other) {
        if (is_near(other)) return true;
      }
      for (int64_t other = from + 1; other < count && in_cell(other); ++other) {
        if (is_near(other)) return true;
      }
      return false;
    });
  };
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(
      count, kLightBlock, context, [&](int64_t place) { company[place] = has_company(place); }));
  return company;
}

// Places on the Morton curve whose points are not duplicates of a kept point before them. Most have
// no other point nearby; only those that have are gone through in turn.
absl::StatusOr<std::vector<int>> DistinctPlaces(const Eigen::Matrix3Xd& points,
                                                const MortonOrder& morton, double distance,
                                                const RunContext& context) {
  const BallCells cells(distance);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> company,
                           PlacesWithCompany(points, morton, cells, context));
  std::vector<int> kept, kept_in_company;
  std::vector<uint64_t> kept_cells;  // of the latter
  // Kept points are at least `distance` apart, so runs are short.
  const auto is_duplicate = [&](const Eigen::Vector3d& point) {
    return cells.Any(point, [&](uint64_t cell) {
      auto place = std::upper_bound(kept_cells.begin(), kept_cells.end(), cell);
      while (place != kept_cells.begin() && *--place == cell) {
        const int other = morton.order[kept_in_company[place - kept_cells.begin()]];
        if (cells.AreSame(points.col(other), point)) return true;
      }
      return false;
    });
  };
  RILIEVO_RETURN_IF_ERROR(
      SerialFor(static_cast<int64_t>(morton.order.size()), context, [&](int64_t i) {
        if (company[i] != 0) {
          if (is_duplicate(points.col(morton.order[i]))) return;
          kept_in_company.push_back(static_cast<int>(i));
          kept_cells.push_back(cells.CellOf(morton.codes[i]));
        }
        kept.push_back(static_cast<int>(i));
      }));
  return kept;
}

// Standard deviations along the principal axes, ascending.
Eigen::Vector3d PrincipalDeviations(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd centered = points.colwise() - mean;
  const Eigen::Matrix3d covariance = centered * centered.transpose() / points.cols();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
}

std::string DropCounts(const CheckedScan& scan) {
  return absl::StrCat("(dropped: ", scan.non_finite, " non-finite, ", scan.duplicates,
                      " duplicates, ", scan.strays, " strays)");
}

absl::Status CheckCount(const CheckedScan& scan, int64_t count) {
  if (count >= kCheckScan.min_scan_points) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("points: ", count, " distinct finite points ",
                                                 DropCounts(scan), ", at least ",
                                                 kCheckScan.min_scan_points, " are needed"));
}

}  // namespace

absl::Status CheckOptions::Validate() const {
  if (duplicate_distance >= 0 && duplicate_distance <= 0.01) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("duplicate_distance: ", duplicate_distance, " is outside [0, 0.01]"));
}

// Works on halved coordinates, so that no difference of finite numbers overflows.
absl::StatusOr<Eigen::AlignedBox3d> StrayLimit(const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                                               const std::vector<int>& columns,
                                               const RunContext& context) {
  const size_t count = columns.size();
  const size_t trim = std::max<size_t>(
      1, static_cast<size_t>(kCheckScan.stray_quantile * static_cast<double>(count)));
  Eigen::Vector3d low, high;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(3, 1, context, [&](int64_t first, int64_t last) {
    std::vector<double> values(count);
    for (int64_t axis = first; axis < last; ++axis) {
      for (size_t i = 0; i < count; ++i) values[i] = points(axis, columns[i]) / 2;
      std::nth_element(values.begin(), values.begin() + trim, values.end());
      low[axis] = values[trim];
      std::nth_element(values.begin() + trim, values.end() - 1 - trim, values.end());
      high[axis] = values[count - 1 - trim];
    }
  }));
  const Eigen::Vector3d center = low / 2 + high / 2;
  double reach = kCheckScan.stray_factor * (high - low).stableNorm();
  // Nearly all points are one: there is no extent to measure by.
  if (!(reach > 0)) reach = std::numeric_limits<double>::infinity();
  return Eigen::AlignedBox3d(2 * (center.array() - reach), 2 * (center.array() + reach));
}

absl::StatusOr<CheckedScan> CheckScan(const PointCloud& scan, const CheckOptions& options,
                                      const RunContext& context,
                                      const std::optional<SpatialFrame>& curve) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckSights(scan.sights, scan.points.cols()));
  context.Report(Stage::kCheck, 0);
  CheckedScan result;
  Columns finite = FiniteColumns(scan.points);
  result.non_finite = finite.dropped;
  RILIEVO_RETURN_IF_ERROR(CheckCount(result, static_cast<int64_t>(finite.kept.size())));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  RILIEVO_ASSIGN_OR_RETURN(const Columns near,
                           DropStrays(scan.points, std::move(finite.kept), context));
  result.strays = near.dropped;
  RILIEVO_ASSIGN_OR_RETURN(result.frame, BoundingFrame(scan.points, near.kept));
  result.curve = curve.value_or(result.frame);
  context.Report(Stage::kCheck, 0.2);

  Eigen::Matrix3Xd unit(3, near.kept.size());
  for (size_t i = 0; i < near.kept.size(); ++i) {
    unit.col(i) = result.curve.UnitFromScan(scan.points.col(near.kept[i]));
  }
  RILIEVO_ASSIGN_OR_RETURN(const MortonOrder morton, ComputeMortonOrder(unit, context));
  context.Report(Stage::kCheck, 0.6);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> places,
                           DistinctPlaces(unit, morton, options.duplicate_distance, context));
  const auto count = static_cast<int64_t>(places.size());
  result.duplicates = static_cast<int64_t>(near.kept.size()) - count;
  RILIEVO_RETURN_IF_ERROR(CheckCount(result, count));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());

  result.points.resize(3, count);
  result.source_index.resize(static_cast<size_t>(count));
  for (int64_t i = 0; i < count; ++i) {
    result.source_index[i] = near.kept[morton.order[places[i]]];
    result.points.col(i) = result.frame.UnitFromScan(scan.points.col(result.source_index[i]));
  }
  result.sights = SightsOf(scan.sights, result.source_index);
  for (auto station : result.sights.stations.colwise()) {
    station = result.frame.UnitFromScan(station);
  }
  const Eigen::Vector3d deviations = PrincipalDeviations(result.points);
  if (deviations[1] < kCheckScan.flat_ratio) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: all ", count, " distinct finite points ", DropCounts(result),
                     " are collinear; a surface needs points that span at least a plane"));
  }
  result.planar = deviations[0] < kCheckScan.flat_ratio;
  context.Report(Stage::kCheck, 1);
  return result;
}

}  // namespace rilievo
