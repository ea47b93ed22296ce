#include "core/scan/local_shape/two_sheets.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/scan/local_shape/otsu_threshold.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {

SheetNeighborhood::SheetNeighborhood(const Eigen::Matrix3Xd& points, std::span<const int> nearest,
                                     double radius)
    : count_(static_cast<int>(nearest.size())) {
  std::copy(nearest.begin(), nearest.end(), around_.begin());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < count_; ++i) mean += points.col(around_[i]) / count_;
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (int i = 0; i < count_; ++i) {
    const Eigen::Vector3d offset = points.col(around_[i]) - mean;
    moments.noalias() += offset * offset.transpose();
  }
  if (!(radius > 0)) return;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(moments);
  for (int i = 0; i < count_; ++i) {
    const Eigen::Vector3d local =
        axes.eigenvectors().transpose() * (points.col(around_[i]) - mean) / radius;
    const double x = local[2], y = local[1];
    rows_[i] << 1, x, y, x * x, x * y, y * y;
    heights_[i] = local[0];
  }
  usable_ = true;
}

std::span<const uint8_t> SheetNeighborhood::FindSheets(const SheetGap& gap) {
  if (!usable_) return {};
  OtsuSplit sheets;
  for (int round = 0; round < kTwoSheets.rounds; ++round) {
    std::array<double, kSheetPoints> flat{};
    Flatten(round > 0, flat.data());
    std::array<double, kSheetPoints> sorted = flat;
    sheets =
        OtsuThreshold({sorted.data(), static_cast<size_t>(count_)}, kTwoSheets.fewest_of_sheet);
    if (sheets.within > kTwoSheets.reject) return {};
    for (int i = 0; i < count_; ++i) sheet_[i] = flat[i] > sheets.threshold ? 1 : 0;
    if (round + 1 < kTwoSheets.rounds) continue;
    const double middle = (sheets.low + sheets.high) / 2;
    const double reach = (sheets.high - sheets.low) / 6;
    const auto between = std::count_if(flat.begin(), flat.begin() + count_, [&](double height) {
      return std::abs(height - middle) < reach;
    });
    if (sheets.within > gap.most_within ||
        static_cast<double>(between) > gap.most_between * static_cast<double>(count_)) {
      return {};
    }
  }
  if (!SheetsOverlap()) return {};
  return {sheet_.data(), static_cast<size_t>(count_)};
}

int SheetNeighborhood::Across(int i) const {
  const auto distance = [&](int j) {
    return sheet_[j] == sheet_[i] ? std::numeric_limits<double>::max()
                                  : (rows_[i] - rows_[j]).segment<2>(1).squaredNorm();
  };
  int nearest = 0;
  for (int j = 1; j < count_; ++j) {
    if (distance(j) < distance(nearest)) nearest = j;
  }
  return around_[nearest];
}

// Whether the sheets lie over the same place: along the plane, points of the smaller one have
// points of the larger one as near as those have each other. Beside a step, an edge or a raised
// pattern they have not.
bool SheetNeighborhood::SheetsOverlap() const {
  const auto high = std::count(sheet_.begin(), sheet_.begin() + count_, uint8_t{1});
  const uint8_t larger = 2 * high > count_ ? 1 : 0;
  return NearestAlong(1 - larger, larger) <
         kTwoSheets.most_apart * kTwoSheets.most_apart * NearestAlong(larger, larger);
}

// The middle squared distance along the plane from a point of one sheet to the nearest other of
// the same or another one.
double SheetNeighborhood::NearestAlong(int from, int to) const {
  std::array<double, kSheetPoints> nearest;
  int found = 0;
  for (int i = 0; i < count_; ++i) {
    if (sheet_[i] != from) continue;
    double least = std::numeric_limits<double>::max();
    for (int j = 0; j < count_; ++j) {
      if (sheet_[j] != to || j == i) continue;
      least = std::min(least, (rows_[i] - rows_[j]).segment<2>(1).squaredNorm());
    }
    nearest[found++] = least;
  }
  std::nth_element(nearest.begin(), nearest.begin() + found / 2, nearest.begin() + found);
  return nearest[found / 2];
}

// Heights over the quadric that fits best, with a step between the sheets if there are any yet.
void SheetNeighborhood::Flatten(bool step, double* flat) const {
  Eigen::Matrix<double, 7, 7> gram = Eigen::Matrix<double, 7, 7>::Zero();
  using Vector7 = Eigen::Matrix<double, 7, 1>;
  Vector7 right = Vector7::Zero();
  for (int i = 0; i < count_; ++i) {
    Vector7 row;
    row << rows_[i], step ? sheet_[i] - 0.5 : 0.0;
    gram.noalias() += row * row.transpose();
    right += heights_[i] * row;
  }
  gram.diagonal().array() += 1e-9;
  const Vector7 fit = gram.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  for (int i = 0; i < count_; ++i) flat[i] = heights_[i] - fit.head<6>().dot(rows_[i]);
}

}  // namespace rilievo
