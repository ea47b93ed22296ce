// The winding number of an oriented point set, from one dipole a patch.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace rilievo {

// A patch of surface.
struct SurfacePatch {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d area = Eigen::Vector3d::Zero();  // area times unit normal, summed over the patch
  double blur = 0;  // squared length over which it is spread: half of its area over pi
};

// The solid angle of the patches seen from `position` over 4 pi, by dipoles (Barill et al. 2018,
// first order): 1 inside a closed surface with outward areas, 0 outside, one half on it. A patch
// at `position` itself counts nothing, as a plane seen from itself.
double WindingNumber(std::span<const SurfacePatch> patches, const Eigen::Vector3d& position);

}  // namespace rilievo
