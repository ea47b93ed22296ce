// Points of a surface as dipoles: what the winding number is made of.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/settings.h"

namespace rilievo {

// A piece of the surface seen from so far that its shape does not count.
struct Dipole {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d area = Eigen::Vector3d::Zero();  // times unit normal, unit frame
  double blur = 0;                                 // squared length over which it is spread
};

inline double ShareOfSurface(double spacing) { return std::numbers::pi / 4 * spacing * spacing; }

// Half of the share of a point over pi, and its noise, for points off the surface see each other
// edgewise no longer.
inline double BlurOfPoint(double spacing, double noise) {
  return spacing * spacing / 8 + 4 * noise * noise;
}

inline Dipole DipoleOf(const OrientedCloud& cloud, int point) {
  return {cloud.points.col(point), ShareOfSurface(cloud.spacing[point]) * cloud.normals.col(point),
          BlurOfPoint(cloud.spacing[point], cloud.noise[point])};
}

// What the dipole adds to 4 pi times the winding number at `position`.
inline double SolidAngle(const Dipole& dipole, const Eigen::Vector3d& position) {
  const Eigen::Vector3d offset = dipole.position - position;
  const double squared = offset.squaredNorm() + dipole.blur;
  return squared > 0 ? dipole.area.dot(offset) / (squared * std::sqrt(squared)) : 0;
}

// What it adds to minus the gradient of the winding number at `position`, without the jump across
// the dipole itself: Plummer's, of a wider blur, for near points lie unevenly along the surface.
inline Eigen::Vector3d WindingDescent(const Dipole& dipole, const Eigen::Vector3d& position) {
  const double blur = kDipole.wider * dipole.blur;
  const Eigen::Vector3d offset = dipole.position - position;
  const double distance = offset.squaredNorm(), squared = distance + blur;
  if (!(squared > 0)) return Eigen::Vector3d::Zero();
  return ((distance - 2 * blur) * dipole.area - 3 * dipole.area.dot(offset) * offset) *
         (0.25 * std::numbers::inv_pi / (squared * squared * std::sqrt(squared)));
}

// By how much the winding number of one falls along the other. Symmetric.
inline double Agreement(const Dipole& a, Dipole b) {
  b.blur = (a.blur + b.blur) / 2;
  return a.area.dot(WindingDescent(b, a.position));
}

// Points that lie together.
struct DipoleSum {
  Dipole sum;         // of areas; position and blur are the mean of the points'
  double size = 0;    // area, however it is turned
  double radius = 0;  // farthest of the points from the mean
};

// Of these points of the cloud. `dipole_of`: a point's, with the sign that it has among them.
template <typename DipoleOfPoint>
DipoleSum SumOfDipoles(const OrientedCloud& cloud, std::span<const int> points,
                       const DipoleOfPoint& dipole_of) {
  DipoleSum all;
  for (const int i : points) {
    const Dipole dipole = dipole_of(i);
    const double share = ShareOfSurface(cloud.spacing[i]);
    all.sum.position += share * dipole.position;
    all.sum.area += dipole.area;
    all.sum.blur += share * dipole.blur;
    all.size += share;
  }
  if (all.size > 0) {
    all.sum.position /= all.size;
    all.sum.blur /= all.size;
  }
  for (const int i : points) {
    all.radius = std::max(all.radius, (cloud.points.col(i) - all.sum.position).norm());
  }
  return all;
}

// Farther apart than kDipole.far_radii of both together.
inline bool AreFar(const DipoleSum& a, const DipoleSum& b) {
  const double near = kDipole.far_radii * (a.radius + b.radius);
  return (b.sum.position - a.sum.position).squaredNorm() > near * near;
}

// The sum over all pairs.
inline double Agreement(std::span<const Dipole> a, std::span<const Dipole> b) {
  double sum = 0;
  for (const Dipole& i : a) {
    for (const Dipole& j : b) sum += Agreement(i, j);
  }
  return sum;
}

}  // namespace rilievo
