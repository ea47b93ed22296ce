// Unit and axes of the files that people export.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/scan_place.h"

namespace rilievo {

// Where nobody says it, z points up, as in maps and in `rilievo view`, and a unit is a metre, as
// glTF has it.
UpDirection UpOrZ(const ScanPlace& place);
double MetresPerUnitOrOne(const ScanPlace& place);

// The rotation that turns this direction to y, which points up in glTF.
Eigen::Quaterniond YUpFrom(UpDirection up);

// A point near `center` with few digits, to take as an origin: multiples of the power of ten below
// the diagonal, which is > 0.
Eigen::Vector3d RoundOrigin(const Eigen::Vector3d& center, double diagonal);

}  // namespace rilievo
