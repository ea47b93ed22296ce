// Which of the two orientations of a consistently oriented patch of points is the outward one.
#pragma once

#include <Eigen/Core>
#include <span>

#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/dipole.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {

// The mean of the normals of a surface, each weighing its share of it: of length 1 where it faces
// one way, 0 where it is closed.
class MeanNormal {
 public:
  void Add(const OrientedCloud& cloud, int point) {
    const double share = ShareOfSurface(cloud.spacing[point]);
    sum_ += share * cloud.normals.col(point);
    area_ += share;
  }

  // The way that the surface faces as one, of length 1; zero unless the mean is longer than
  // `least`, which is 1/2 of a hemisphere.
  Eigen::Vector3d Front(double least) const {
    if (!(sum_.norm() > least * area_)) return Eigen::Vector3d::Zero();
    return sum_.normalized();
  }

 private:
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  double area_ = 0;
};

// The mean winding number at points of a surface, each standing for its share of it: a sample of
// `members`, evenly along the list.
double MeanWinding(const WindingField& field, const OrientedCloud& cloud,
                   std::span<const int> members);

// +1 or -1: the factor that turns the normals of `members` (not empty) outward. A closed surface
// has a mean winding number of 1/2 on itself where its normals point outward, and of -1/2 where
// they point inward; an open one of nearly 0, and outward is the convex side, or up (+z, else +y,
// else +x) when no side plainly is.
int OutwardSign(const OrientedCloud& cloud, std::span<const int> members);

}  // namespace rilievo
