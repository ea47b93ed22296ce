#include "core/scan/orientation/winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "core/scan/orientation/settings.h"

namespace rilievo {
namespace {

double FarFrom(double radius, double blur) {
  return kDipole.far_radii * std::sqrt(radius * radius + blur);
}

}  // namespace

WindingField::WindingField(const OrientedCloud& cloud, std::vector<int> members)
    : cloud_(cloud), members_(std::move(members)) {
  AddLeaves();
  while (levels_.back().size() > 1) AddLevel();
}

void WindingField::AddLeaves() {
  std::vector<Cell> leaves((members_.size() + kWindingNumber.leaf_points - 1) /
                           kWindingNumber.leaf_points);
  for (size_t leaf = 0; leaf < leaves.size(); ++leaf) {
    Cell& cell = leaves[leaf];
    const size_t begin = leaf * kWindingNumber.leaf_points,
                 end = std::min(members_.size(), begin + kWindingNumber.leaf_points);
    static_cast<DipoleSum&>(cell) =
        SumOfDipoles(cloud_, std::span(members_).subspan(begin, end - begin),
                     [this](int i) { return DipoleOf(cloud_, i); });
    cell.far = FarFrom(cell.radius, cell.sum.blur);
  }
  levels_.push_back(std::move(leaves));
}

void WindingField::AddLevel() {
  const std::vector<Cell>& below = levels_.back();
  std::vector<Cell> level((below.size() + kWindingNumber.children - 1) / kWindingNumber.children);
  for (size_t at = 0; at < level.size(); ++at) {
    Cell& cell = level[at];
    const size_t begin = at * kWindingNumber.children,
                 end = std::min(below.size(), begin + kWindingNumber.children);
    for (size_t child = begin; child < end; ++child) {
      const Cell& part = below[child];
      cell.sum.position += part.size * part.sum.position;
      cell.sum.area += part.sum.area;
      cell.sum.blur += part.size * part.sum.blur;
      cell.size += part.size;
    }
    if (cell.size > 0) {
      cell.sum.position /= cell.size;
      cell.sum.blur /= cell.size;
    }
    for (size_t child = begin; child < end; ++child) {
      const Cell& part = below[child];
      const double reach = (part.sum.position - cell.sum.position).norm() + part.radius;
      cell.radius = std::max(cell.radius, reach);
    }
    cell.far = FarFrom(cell.radius, cell.sum.blur);
  }
  levels_.push_back(std::move(level));
}

template <typename Visit>
void WindingField::ForEachSeen(size_t level, size_t cell, const Eigen::Vector3d& position,
                               const Visit& visit) const {
  const Cell& seen = levels_[level][cell];
  if ((seen.sum.position - position).squaredNorm() > seen.far * seen.far) {
    visit(seen.sum);
  } else if (level == 0) {
    const size_t end = std::min(members_.size(), (cell + 1) * kWindingNumber.leaf_points);
    for (size_t m = cell * kWindingNumber.leaf_points; m < end; ++m)
      visit(DipoleOf(cloud_, members_[m]));
  } else {
    const size_t end = std::min(levels_[level - 1].size(), (cell + 1) * kWindingNumber.children);
    for (size_t child = cell * kWindingNumber.children; child < end; ++child) {
      ForEachSeen(level - 1, child, position, visit);
    }
  }
}

double WindingField::At(const Eigen::Vector3d& position) const {
  double sum = 0;
  if (!members_.empty()) {
    ForEachSeen(levels_.size() - 1, 0, position,
                [&](const Dipole& dipole) { sum += SolidAngle(dipole, position); });
  }
  return sum * (0.25 * std::numbers::inv_pi);
}

Eigen::Vector3d WindingField::DescentAt(const Eigen::Vector3d& position) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (!members_.empty()) {
    ForEachSeen(levels_.size() - 1, 0, position,
                [&](const Dipole& dipole) { sum += WindingDescent(dipole, position); });
  }
  return sum;
}

}  // namespace rilievo
