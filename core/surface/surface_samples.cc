#include "core/surface/surface_samples.h"

#include <Eigen/Geometry>
#include <cmath>

namespace rilievo {
namespace {

using Eigen::Vector3d;

// In [0, 1), 32 bits of it.
double UnitFromBits(uint64_t bits) { return static_cast<double>(bits >> 32) * 0x1p-32; }

uint64_t BitsOf(uint64_t seed, int64_t sample) {
  return MixBits(seed ^ MixBits(static_cast<uint64_t>(sample)));
}

// Running area at which the sample lies.
double PlaceOf(int64_t sample, uint64_t bits, double slice) {
  return (static_cast<double>(sample) + UnitFromBits(bits)) * slice;
}

double TwiceArea(const Eigen::Matrix3Xd& vertices, const Eigen::Vector3i& triangle) {
  const Vector3d a = vertices.col(triangle[0]);
  return (vertices.col(triangle[1]) - a).cross(vertices.col(triangle[2]) - a).norm();
}

// Uniform in the triangle (Turk 1990): the root spreads by area, the rest along the chord.
Vector3d PointWithin(const Eigen::Matrix3Xd& vertices, const Eigen::Vector3i& triangle,
                     uint64_t bits) {
  const uint64_t place = MixBits(bits);
  const double root = std::sqrt(UnitFromBits(place));
  const double along = UnitFromBits(place << 32);
  return (1 - root) * vertices.col(triangle[0]) + root * (1 - along) * vertices.col(triangle[1]) +
         root * along * vertices.col(triangle[2]);
}

}  // namespace

uint64_t MixBits(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

Eigen::Matrix3Xd SampleByArea(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                              std::span<const int> order, int64_t count, uint64_t seed,
                              std::vector<int>* faces) {
  Eigen::VectorXd area(static_cast<Eigen::Index>(order.size()));
  for (Eigen::Index i = 0; i < area.size(); ++i) {
    area[i] = TwiceArea(vertices, triangles.col(order[i]));
  }
  if (!(area.sum() > 0)) area.setOnes();
  const double slice = area.sum() / static_cast<double>(count);
  Eigen::Matrix3Xd points(3, count);
  if (faces != nullptr) faces->assign(static_cast<size_t>(count), 0);
  Eigen::Index face = 0;
  double before = 0;  // area of the triangles before `face`
  for (int64_t i = 0; i < count; ++i) {
    const uint64_t bits = BitsOf(seed, i);
    const double at = PlaceOf(i, bits, slice);
    while (face + 1 < area.size() && before + area[face] <= at) before += area[face++];
    if (faces != nullptr) (*faces)[i] = order[face];
    points.col(i) = PointWithin(vertices, triangles.col(order[face]), bits);
  }
  return points;
}

Eigen::Matrix3Xd SamplePiece(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                             double slice, uint64_t seed, std::vector<int>* faces) {
  std::vector<Vector3d> points;
  faces->clear();
  double before = 0;  // area of the triangles so far
  for (int f = 0; f < static_cast<int>(triangles.cols()); ++f) {
    before += TwiceArea(vertices, triangles.col(f)) / 2;
    for (;;) {
      const auto sample = static_cast<int64_t>(points.size());
      const uint64_t bits = BitsOf(seed, sample);
      if (PlaceOf(sample, bits, slice) >= before) break;
      points.push_back(PointWithin(vertices, triangles.col(f), bits));
      faces->push_back(f);
    }
  }
  return Eigen::Map<const Eigen::Matrix3Xd>(points.empty() ? nullptr : points.front().data(), 3,
                                            static_cast<Eigen::Index>(points.size()));
}

}  // namespace rilievo
