// The winding number of an oriented point set.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/dipole.h"

namespace rilievo {

// The solid angle of the surface seen from a position over 4 pi: 1 inside a closed surface with
// outward normals, 0 outside, one half on it; -1 inside and minus one half on it where the normals
// point inward. Each point is a dipole as large as its share of the surface, spread over its
// spacing and noise, so that a point seen from itself counts nothing; far points count together
// (Barill et al. 2018, first order, with stretches of the Morton curve for cells).
class WindingField {
 public:
  // `members`: points of the cloud, ascending. The cloud must outlive the field and stay as it is.
  WindingField(const OrientedCloud& cloud, std::vector<int> members);

  double At(const Eigen::Vector3d& position) const;

  // Minus the gradient of the winding number, without its jumps across the points themselves: the
  // rest of a surface goes on here with normals along it. Per length, unit frame.
  Eigen::Vector3d DescentAt(const Eigen::Vector3d& position) const;

 private:
  struct Cell : DipoleSum {
    double far = 0;  // distance from which it counts as one dipole
  };
  void AddLeaves();
  void AddLevel();
  // Calls visit(dipole) for all points of a cell, those far from the position as one.
  template <typename Visit>
  void ForEachSeen(size_t level, size_t cell, const Eigen::Vector3d& position,
                   const Visit& visit) const;

  const OrientedCloud& cloud_;
  std::vector<int> members_;
  std::vector<std::vector<Cell>> levels_;  // leaves first
};

}  // namespace rilievo
