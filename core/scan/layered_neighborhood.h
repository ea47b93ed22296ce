// The points around one point, and whether they stand in two layers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

namespace rilievo {

// Of a neighbourhood, with the point itself.
inline constexpr int kLayeredPoints = 64;

// How clearly two layers must stand apart.
struct LayerGap {
  double most_within;   // what is left of the squares within the layers
  double most_between;  // share of the points in the middle third between the layers
};

// The points nearest to one, in the frame of their plane.
class LayeredNeighborhood {
 public:
  // `nearest`: to the one and with it, ascending by distance, at most kLayeredPoints; the last lies
  // at `radius`.
  LayeredNeighborhood(const Eigen::Matrix3Xd& points, std::span<const int> nearest, double radius);

  // The layer of each point, low or high, over the quadric through all of them; empty where there
  // are no two layers over the same place.
  std::span<const uint8_t> FindLayers(const LayerGap& gap);

  // Of the other layer, the point nearest along the plane to the i-th. After FindLayers.
  int Across(int i) const;

  int count() const { return count_; }
  int point(int i) const { return around_[i]; }  // ascending by distance

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  bool LayersOverlap() const;
  double NearestAlong(int from, int to) const;
  void Flatten(bool step, double* flat) const;

  int count_ = 0;
  bool usable_ = false;
  std::array<int, kLayeredPoints> around_;
  std::array<Vector6, kLayeredPoints> rows_;  // 1, x, y, x^2, x y, y^2 along the plane
  std::array<double, kLayeredPoints> heights_;
  std::array<uint8_t, kLayeredPoints> layer_;
};

}  // namespace rilievo
