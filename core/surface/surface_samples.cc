#include "core/surface/surface_samples.h"

#include <Eigen/Geometry>
#include <cmath>

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Finalizer of SplitMix64 (Steele, Lea, Flood 2014): a counter in, 64 well-mixed bits out.
uint64_t MixBits(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// In [0, 1), 32 bits of it.
double UnitFromBits(uint64_t bits) { return static_cast<double>(bits >> 32) * 0x1p-32; }

}  // namespace

Eigen::Matrix3Xd SampleByArea(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                              std::span<const int> order, int64_t count, uint64_t seed,
                              std::vector<int>* faces) {
  Eigen::VectorXd area(static_cast<Eigen::Index>(order.size()));
  for (Eigen::Index i = 0; i < area.size(); ++i) {
    const auto triangle = triangles.col(order[i]);
    const Vector3d a = vertices.col(triangle[0]);
    area[i] = (vertices.col(triangle[1]) - a).cross(vertices.col(triangle[2]) - a).norm();
  }
  if (!(area.sum() > 0)) area.setOnes();
  const double slice = area.sum() / static_cast<double>(count);
  Eigen::Matrix3Xd points(3, count);
  if (faces != nullptr) faces->assign(static_cast<size_t>(count), 0);
  Eigen::Index face = 0;
  double before = 0;  // area of the triangles before `face`
  for (int64_t i = 0; i < count; ++i) {
    const uint64_t bits = MixBits(seed ^ MixBits(static_cast<uint64_t>(i)));
    const double at = (static_cast<double>(i) + UnitFromBits(bits)) * slice;
    while (face + 1 < area.size() && before + area[face] <= at) before += area[face++];
    if (faces != nullptr) (*faces)[i] = order[face];
    // Uniform in the triangle (Turk 1990): the root spreads by area, the rest along the chord.
    const uint64_t place = MixBits(bits);
    const double root = std::sqrt(UnitFromBits(place));
    const double along = UnitFromBits(place << 32);
    const auto triangle = triangles.col(order[face]);
    points.col(i) = (1 - root) * vertices.col(triangle[0]) +
                    root * (1 - along) * vertices.col(triangle[1]) +
                    root * along * vertices.col(triangle[2]);
  }
  return points;
}

}  // namespace rilievo
