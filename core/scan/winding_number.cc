#include "core/scan/winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace rilievo {
namespace {

constexpr size_t kLeafPoints = 8;
constexpr size_t kChildren = 4;
// Radii from which a cell counts as one dipole.
constexpr double kFar = 2.0;

double ShareOfSurface(double spacing) { return std::numbers::pi / 4 * spacing * spacing; }

// Squared length over which a point's dipole is spread: half of its share over pi, and its noise,
// for points off the surface see each other edgewise no longer.
double Blur(double spacing, double noise) { return spacing * spacing / 8 + 4 * noise * noise; }

double Dipole(const Eigen::Vector3d& area, const Eigen::Vector3d& offset, double blur) {
  const double squared = offset.squaredNorm() + blur;
  return squared > 0 ? area.dot(offset) / (squared * std::sqrt(squared)) : 0;
}

}  // namespace

WindingField::WindingField(const OrientedCloud& cloud, std::vector<int> members)
    : cloud_(cloud), members_(std::move(members)) {
  AddLeaves();
  while (levels_.back().size() > 1) AddLevel();
}

void WindingField::AddLeaves() {
  std::vector<Cell> leaves((members_.size() + kLeafPoints - 1) / kLeafPoints);
  for (size_t leaf = 0; leaf < leaves.size(); ++leaf) {
    Cell& cell = leaves[leaf];
    const size_t begin = leaf * kLeafPoints, end = std::min(members_.size(), begin + kLeafPoints);
    for (size_t m = begin; m < end; ++m) {
      const double share = ShareOfSurface(cloud_.spacing[members_[m]]);
      cell.center += share * cloud_.points.col(members_[m]);
      cell.area += share * cloud_.normals.col(members_[m]);
      cell.blur += share * Blur(cloud_.spacing[members_[m]], cloud_.noise[members_[m]]);
      cell.size += share;
    }
    if (cell.size > 0) {
      cell.center /= cell.size;
      cell.blur /= cell.size;
    }
    for (size_t m = begin; m < end; ++m) {
      cell.radius = std::max(cell.radius, (cloud_.points.col(members_[m]) - cell.center).norm());
    }
  }
  levels_.push_back(std::move(leaves));
}

void WindingField::AddLevel() {
  const std::vector<Cell>& below = levels_.back();
  std::vector<Cell> level((below.size() + kChildren - 1) / kChildren);
  for (size_t at = 0; at < level.size(); ++at) {
    Cell& cell = level[at];
    const size_t begin = at * kChildren, end = std::min(below.size(), begin + kChildren);
    for (size_t child = begin; child < end; ++child) {
      cell.center += below[child].size * below[child].center;
      cell.area += below[child].area;
      cell.blur += below[child].size * below[child].blur;
      cell.size += below[child].size;
    }
    if (cell.size > 0) {
      cell.center /= cell.size;
      cell.blur /= cell.size;
    }
    for (size_t child = begin; child < end; ++child) {
      const double reach = (below[child].center - cell.center).norm() + below[child].radius;
      cell.radius = std::max(cell.radius, reach);
    }
  }
  levels_.push_back(std::move(level));
}

double WindingField::Seen(size_t level, size_t cell, const Eigen::Vector3d& position) const {
  const Cell& seen = levels_[level][cell];
  const Eigen::Vector3d offset = seen.center - position;
  if (offset.squaredNorm() > kFar * kFar * (seen.radius * seen.radius + seen.blur)) {
    return Dipole(seen.area, offset, seen.blur);
  }
  double sum = 0;
  if (level == 0) {
    const size_t end = std::min(members_.size(), (cell + 1) * kLeafPoints);
    for (size_t m = cell * kLeafPoints; m < end; ++m) {
      const int i = members_[m];
      sum += ShareOfSurface(cloud_.spacing[i]) * Dipole(cloud_.normals.col(i),
                                                        cloud_.points.col(i) - position,
                                                        Blur(cloud_.spacing[i], cloud_.noise[i]));
    }
    return sum;
  }
  const size_t end = std::min(levels_[level - 1].size(), (cell + 1) * kChildren);
  for (size_t child = cell * kChildren; child < end; ++child) {
    sum += Seen(level - 1, child, position);
  }
  return sum;
}

double WindingField::At(const Eigen::Vector3d& position) const {
  if (members_.empty()) return 0;
  return Seen(levels_.size() - 1, 0, position) * (0.25 * std::numbers::inv_pi);
}

}  // namespace rilievo
