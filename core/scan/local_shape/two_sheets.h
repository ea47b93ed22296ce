// The points around one point, and whether they stand in two sheets.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "core/points/neighbor_graph.h"
#include "core/points/settings.h"

namespace rilievo {

// Of a neighbourhood, with the point itself.
inline constexpr int kSheetPoints = kNeighborGraph.most_neighbors;

// How clearly two sheets must stand apart.
struct SheetGap {
  double most_within;   // what is left of the squares within the sheets
  double most_between;  // share of the points in the middle third between the sheets
};

// The points nearest to one, in the frame of their plane.
class SheetNeighborhood {
 public:
  // `nearest`: to the one and with it, ascending by distance, at most kSheetPoints; the last lies
  // at `radius`.
  SheetNeighborhood(const Eigen::Matrix3Xd& points, std::span<const int> nearest, double radius);

  // The sheet of each point, low or high, over the quadric through all of them; empty where there
  // are not two sheets over the same place.
  std::span<const uint8_t> FindSheets(const SheetGap& gap);

  // Of the other sheet, the point nearest along the plane to the i-th. After FindSheets.
  int Across(int i) const;

  int count() const { return count_; }
  int point(int i) const { return around_[i]; }  // ascending by distance

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  bool SheetsOverlap() const;
  double NearestAlong(int from, int to) const;
  void Flatten(bool step, double* flat) const;

  int count_ = 0;
  bool usable_ = false;
  std::array<int, kSheetPoints> around_;
  std::array<Vector6, kSheetPoints> rows_;  // 1, x, y, x^2, x y, y^2 along the plane
  std::array<double, kSheetPoints> heights_;
  std::array<uint8_t, kSheetPoints> sheet_;
};

}  // namespace rilievo
