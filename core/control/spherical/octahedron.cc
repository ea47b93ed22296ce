#include "core/control/spherical/octahedron.h"

#include <Eigen/Geometry>
#include <map>
#include <utility>

namespace rilievo {

using Eigen::Vector3d;

Octahedron::Octahedron(int levels) {
  directions_.resize(3, 6);
  directions_ << 1, 0, -1, 0, 0, 0,  //
      0, 1, 0, -1, 0, 0,             //
      0, 0, 0, 0, 1, -1;
  Eigen::Matrix3Xi faces(3, 8);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const int next = (quarter + 1) % 4;
    faces.col(2 * quarter) << quarter, next, 4;
    faces.col(2 * quarter + 1) << next, quarter, 5;
  }
  faces_.push_back(faces);
  for (int level = 0; level < levels; ++level) Refine();
}

void Octahedron::Refine() {
  const Eigen::Matrix3Xi coarse = faces_.back();
  int count = static_cast<int>(directions_.cols());
  directions_.conservativeResize(3, count + coarse.cols() * 3 / 2);
  std::map<std::pair<int, int>, int> midpoints;
  const auto midpoint = [&](int a, int b) {
    const auto [place, added] = midpoints.try_emplace(std::minmax(a, b), count);
    if (added) {
      directions_.col(count++) = (directions_.col(a) + directions_.col(b)).normalized();
    }
    return place->second;
  };
  Eigen::Matrix3Xi fine(3, 4 * coarse.cols());
  for (int f = 0; f < coarse.cols(); ++f) {
    const int a = coarse(0, f), b = coarse(1, f), c = coarse(2, f);
    const int ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
    fine.col(4 * f) << a, ab, ca;
    fine.col(4 * f + 1) << ab, b, bc;
    fine.col(4 * f + 2) << ca, bc, c;
    fine.col(4 * f + 3) << ab, bc, ca;
  }
  faces_.push_back(std::move(fine));
}

int Octahedron::FaceOf(const Vector3d& direction) const {
  const int quarter =
      direction.x() >= 0 ? (direction.y() >= 0 ? 0 : 3) : (direction.y() >= 0 ? 1 : 2);
  int face = 2 * quarter + (direction.z() >= 0 ? 0 : 1);
  for (int level = 1; level <= levels(); ++level) {
    // The middle child's sides part it from the three others.
    const Eigen::Vector3i middle = faces_[level].col(4 * face + 3);
    const Vector3d ab = directions_.col(middle[0]);
    const Vector3d bc = directions_.col(middle[1]);
    const Vector3d ca = directions_.col(middle[2]);
    int child = 3;
    if (ca.cross(ab).dot(direction) < 0) {
      child = 0;
    } else if (ab.cross(bc).dot(direction) < 0) {
      child = 1;
    } else if (bc.cross(ca).dot(direction) < 0) {
      child = 2;
    }
    face = 4 * face + child;
  }
  return face;
}

}  // namespace rilievo
