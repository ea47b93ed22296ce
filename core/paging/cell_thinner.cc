#include "core/paging/cell_thinner.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>

namespace rilievo {
namespace {

// Deviation from its plane of a cell of a single point, in its side; of n points it is a
// sqrt(n)-th of that at least, so that few points count as unsure.
constexpr double kUnsure = 0.05;
// Deviation of a cell at a border where none of it is filled, in its side.
constexpr double kUnfilled = 0.2;
// Points of a cell that may lie at a border.
constexpr double kMostAtBorder = 128;
// A cell lies at a border if even points would leave as many octants empty with less probability.
constexpr double kChance = 1e-3;
constexpr double kStepsPerOctave = 16;

CellDetail DetailOf(double variance, double side) {
  const double octaves = std::log2(variance * side) / 2;
  const double step = CellThinner::kMostDetail + std::floor(kStepsPerOctave * octaves);
  return static_cast<CellDetail>(std::clamp<double>(step, 1, CellThinner::kMostDetail));
}

// Of the octants of a cube that the plane crosses near their middles, the share that holds no
// points; 0 if that may be chance. Of n points that are spread evenly over c octants none lies in a
// given octant with probability exp(-n / c).
double UnfilledShare(const Eigen::Vector3d& middle, double side, uint8_t octants, double points,
                     const Eigen::Vector3d& on_plane, const Eigen::Vector3d& normal) {
  const double near = side / 8 * normal.lpNorm<1>();
  double crossed = 0, empty = 0;
  for (int octant = 0; octant < 8; ++octant) {
    Eigen::Vector3d of_octant = middle;
    for (int axis = 0; axis < 3; ++axis) {
      of_octant[axis] += (octant >> axis & 1) != 0 ? side / 4 : -side / 4;
    }
    if (std::abs(normal.dot(of_octant - on_plane)) > near) continue;
    ++crossed;
    empty += (octants >> octant & 1) == 0 ? 1 : 0;
  }
  if (empty == 0) return 0;
  const double chance = crossed * std::exp(-points / crossed);
  return std::pow(chance, empty) < kChance ? empty / crossed : 0;
}

}  // namespace

void CellThinner::Moments::Add(const Moments& other) {
  const double sum = count + other.count;
  const Eigen::Vector3d apart = other.mean - mean;
  scatter += other.scatter + (count * other.count / sum) * apart * apart.transpose();
  mean += other.count / sum * apart;
  count = sum;
}

CellThinner::Details CellThinner::DetailsOf(const Cell& cell, int level) const {
  const double side = std::ldexp(1.0, -level), count = cell.moments.count;
  Details details;
  if (count <= 1) return details;  // which tell of all there is
  if (count <= 3) {                // in a plane
    details.of_plane = DetailOf(kUnsure * kUnsure * side * side / count, side);
    return details;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(cell.moments.scatter);
  const double off_plane = std::max(0.0, axes.eigenvalues()[0]);
  details.of_plane = DetailOf((off_plane + kUnsure * kUnsure * side * side) / count, side);
  if (count > kMostAtBorder) return details;
  const double unfilled = UnfilledShare(cell.middle, side, cell.octants, count, cell.moments.mean,
                                        axes.eigenvectors().col(0));
  if (unfilled > 0) {
    details.of_border = DetailOf(kUnfilled * kUnfilled * side * side * unfilled, side);
  }
  return details;
}

// All points of the cell instead of what is chosen of the cells in it under limits below `detail`.
void CellThinner::GainWholeCell(const Cell& cell, CellDetail detail) {
  int64_t above = 0;
  size_t kept = cell.first_gain;
  for (size_t i = cell.first_gain; i < recent_gains_.size(); ++i) {
    if (recent_gains_[i].detail <= detail) continue;
    above += recent_gains_[i].points;
    recent_gains_[kept++] = recent_gains_[i];
  }
  recent_gains_.resize(kept);
  recent_gains_.push_back({detail, static_cast<int64_t>(cell.moments.count) - 1 - above});
}

void CellThinner::Close(int level) {
  Cell& cell = open_.back();
  CellDetail of_border = 0;
  if (level < deepest_) {
    const Details details = DetailsOf(cell, level);
    cell.detail = std::max(cell.detail, details.of_plane);
    recent_gains_.push_back({cell.detail, std::popcount(cell.octants) - 1});
    of_border = details.of_border;
    if (of_border > 0) GainWholeCell(cell, of_border);
    cell.detail = std::max(cell.detail, of_border);
  }
  if (of_border > limit_) {
    chosen_.resize(cell.first_chosen);
    chosen_.insert(chosen_.end(), recent_.begin() + static_cast<std::ptrdiff_t>(cell.first_recent),
                   recent_.end());
  } else if (cell.detail <= limit_) {
    chosen_.resize(cell.first_chosen);
    chosen_.push_back(cell.chosen);
  }
  if (level > coarsest_) {
    Cell& parent = open_[open_.size() - 2];
    parent.moments.Add(cell.moments);
    parent.detail = std::max(parent.detail, cell.detail);
    int octant = 0;
    for (int axis = 0; axis < 3; ++axis) {
      octant |= cell.middle[axis] > parent.middle[axis] ? 1 << axis : 0;
    }
    parent.octants |= static_cast<uint8_t>(1 << octant);
  }
  // No larger cell is chosen whole.
  if (cell.moments.count > kMostAtBorder || level == coarsest_) {
    for (size_t i = cell.first_gain; i < recent_gains_.size(); ++i) {
      gains_[recent_gains_[i].detail] += recent_gains_[i].points;
    }
    recent_gains_.resize(cell.first_gain);
    recent_.resize(cell.first_recent);
  }
  open_.pop_back();
}

void CellThinner::Open(int level, const Eigen::Vector3d& point, const Eigen::Vector3d& unit) {
  if (open_.empty()) ++coarsest_cells_;
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    const uint32_t place = MortonCell(unit[axis]) >> (kMortonBits - level);
    cell.middle[axis] = std::ldexp(place + 0.5, -level) - 0.5;
  }
  cell.chosen = point;
  cell.distance = (unit - cell.middle).squaredNorm();
  cell.first_chosen = chosen_.size();
  cell.first_gain = recent_gains_.size();
  cell.first_recent = recent_.size();
  open_.push_back(cell);
}

void CellThinner::Add(const Eigen::Vector3d& point) {
  const Eigen::Vector3d unit = curve_.UnitFromScan(point);
  const uint64_t code =
      MortonCode(MortonCell(unit.x()), MortonCell(unit.y()), MortonCell(unit.z()));
  int first = coarsest_;  // the level from which on it lies in other cells than the last point
  if (!open_.empty()) {
    first = std::max(coarsest_, FirstLevelApart(code, last_code_));
    for (int level = deepest_; level >= first; --level) Close(level);
  }
  last_code_ = code;
  for (Cell& cell : open_) {
    const double distance = (unit - cell.middle).squaredNorm();
    if (distance >= cell.distance) continue;
    cell.distance = distance;
    cell.chosen = point;
  }
  for (int level = first; level <= deepest_; ++level) Open(level, point, unit);
  // Of a fuller one, and of those it lies in, none is chosen whole.
  if (open_.back().moments.count <= kMostAtBorder) recent_.push_back(point);
  open_.back().moments.Add({1, unit, Eigen::Matrix3d::Zero()});
}

Eigen::Matrix3Xd CellThinner::Finish() {
  for (int level = deepest_; !open_.empty(); --level) Close(level);
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(chosen_.size()));
  for (size_t i = 0; i < chosen_.size(); ++i) points.col(static_cast<Eigen::Index>(i)) = chosen_[i];
  return points;
}

CellDetail CellThinner::LimitFor(int64_t most) const {
  int64_t count = coarsest_cells_;
  CellDetail limit = kMostDetail;
  while (limit > 0 && count + gains_[limit] <= most) count += gains_[limit--];
  return limit;
}

}  // namespace rilievo
