// Where a plane cuts a mesh.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// The points x with normal . x = offset.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit
  double offset = 0;
};

// Two unit vectors in the plane, right-handed with its normal: the first is horizontal (x where the
// plane is), the second points upward where it can.
struct PlaneAxes {
  Eigen::Vector3d right, up;
};
PlaneAxes AxesOf(const Plane& plane);

struct SectionPolyline {
  Eigen::Matrix3Xd points;  // column = point; the first is not repeated where it is closed
  bool closed = false;
};

struct PlaneSection {
  Plane plane;
  // Seen from the tip of the normal the inside lies on the left.
  std::vector<SectionPolyline> polylines;
  double length = 0;
  double area = 0;  // of the cut, holes taken off; 0 unless all polylines are closed
};

// A vertex in the plane counts as above it, so a triangle that touches the plane adds nothing or a
// segment of its own, and polylines of a closed mesh are closed. Polylines and their points come in
// an order that depends on the mesh alone. INVALID_ARGUMENT unless the normal has a length and all
// numbers are finite; the normal need not be a unit vector: that of the result is.
absl::StatusOr<PlaneSection> CutByPlane(const TriangleMesh& mesh, const Eigen::Vector3d& normal,
                                        double offset);

}  // namespace rilievo
