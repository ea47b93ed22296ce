// Area, volume, centroid and inertia of triangles.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"

namespace rilievo {

// In the frame and unit of the vertices. A closed mesh is treated as a solid with density 1 per
// volume, an open mesh as a shell with density 1 per area.
struct MassProperties {
  bool closed = false;
  double area = 0;
  double volume = 0;  // signed: positive where triangles face outward; 0 of an open mesh
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  // of the solid, or of the shell
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   // about the centroid
};

// Exact for the triangles but for rounding, however far from the origin they lie (Mirtich 1996 in
// the form of Blow and Binstock 2004: moments of tetrahedra). Closed: no edge belongs to one
// triangle only. INVALID_ARGUMENT without triangles, or where a coordinate is not finite.
absl::StatusOr<MassProperties> MassPropertiesOf(const Eigen::Matrix3Xd& vertices,
                                                const Eigen::Matrix3Xi& triangles);

}  // namespace rilievo
