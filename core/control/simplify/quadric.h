// Quadric error functions: sums of squared distances to planes and points (Garland, Heckbert 1997).
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace rilievo {

// x -> x^T A x - 2 b^T x + c with A symmetric and positive semidefinite. Adding two of them adds
// their values everywhere, so the least value of a sum is never below that of a part.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // A
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  // weight * (normal . (x - point))^2
  void AddPlane(const Eigen::Vector3d& normal, const Eigen::Vector3d& point, double weight) {
    const double offset = normal.dot(point);
    const Eigen::Vector3d n = weight * normal;
    xx += n.x() * normal.x();
    xy += n.x() * normal.y();
    xz += n.x() * normal.z();
    yy += n.y() * normal.y();
    yz += n.y() * normal.z();
    zz += n.z() * normal.z();
    b += offset * n;
    c += weight * offset * offset;
  }

  // weight * |x - point|^2
  void AddPoint(const Eigen::Vector3d& point, double weight) {
    xx += weight;
    yy += weight;
    zz += weight;
    b += weight * point;
    c += weight * point.squaredNorm();
  }

  Quadric& operator+=(const Quadric& other) {
    xx += other.xx;
    xy += other.xy;
    xz += other.xz;
    yy += other.yy;
    yz += other.yz;
    zz += other.zz;
    b += other.b;
    c += other.c;
    return *this;
  }

  double operator()(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d ax(xx * x.x() + xy * x.y() + xz * x.z(),
                             xy * x.x() + yy * x.y() + yz * x.z(),
                             xz * x.x() + yz * x.y() + zz * x.z());
    return x.dot(ax - 2 * b) + c;
  }

  // The place of the least value, or `fallback` where A is singular to working precision (never
  // once a point term was added).
  Eigen::Vector3d Minimum(const Eigen::Vector3d& fallback) const {
    const double m00 = yy * zz - yz * yz;
    const double m01 = xz * yz - xy * zz;
    const double m02 = xy * yz - xz * yy;
    const double determinant = xx * m00 + xy * m01 + xz * m02;
    const double trace = xx + yy + zz;
    if (!(determinant > 1e-12 * trace * trace * trace)) return fallback;
    const double m11 = xx * zz - xz * xz;
    const double m12 = xy * xz - xx * yz;
    const double m22 = xx * yy - xy * xy;
    return Eigen::Vector3d(m00 * b.x() + m01 * b.y() + m02 * b.z(),
                           m01 * b.x() + m11 * b.y() + m12 * b.z(),
                           m02 * b.x() + m12 * b.y() + m22 * b.z()) /
           determinant;
  }
};

}  // namespace rilievo
