// The shapes that a mesh is trimmed by.
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/plane_section.h"

namespace rilievo {

// Axis-aligned; low is below high on every axis.
struct TrimBox {
  Eigen::Vector3d low, high;
};

struct TrimSphere {
  Eigen::Vector3d center;
  double radius;  // > 0
};

// A closed polyline swept both ways along a direction without end.
struct TrimPrism {
  Eigen::Matrix3Xd corners;   // column = corner, at least 3, in order; the last joins the first
  Eigen::Vector3d direction;  // not zero, of any length
};

// Frame of the mesh. Inside of a plane is the side that its normal, of any length, points away
// from.
using TrimShape = std::variant<Plane, TrimBox, TrimSphere, TrimPrism>;

// A plane or a sphere that bounds a shape.
struct TrimSide {
  Eigen::Vector3d place;  // unit normal of a plane, or centre of a sphere
  double offset;          // of the plane
  double radius = 0;      // 0: a plane
  // Signed distance, negative inside.
  double ValueAt(const Eigen::Vector3d& point) const;
  // Where the side is met between two points, one inside and one outside.
  Eigen::Vector3d Crossing(const Eigen::Vector3d& p, const Eigen::Vector3d& q) const;
};

inline constexpr Eigen::Index kMostPrismCorners = 1000;

// What bounds a shape: the inside of all sides, or of an outline.
struct TrimBounds {
  std::vector<TrimSide> sides;
  // Of a prism seen against its direction: column = corner, counter-clockwise; sides[i] goes
  // through corner i and the next. Empty for the other shapes, which are convex.
  Eigen::Matrix2Xd outline;
  Eigen::Matrix<double, 2, 3> to_outline;  // from the frame of the mesh
};

// INVALID_ARGUMENT for numbers that are not finite or describe no shape, for a polyline that
// crosses itself along its direction, and for one of more than kMostPrismCorners.
absl::StatusOr<TrimBounds> BoundsOf(const TrimShape& shape);

// The inside of the shape as a closed mesh, as far as it may meet `mesh`; a sphere to within
// kTrimTolerance of the diagonal of `mesh`, or 4e-6 of its radius where that is more. Errors as
// BoundsOf().
absl::StatusOr<TriangleMesh> SolidOfShape(const TrimShape& shape, const TriangleMesh& mesh);

// How far edges and triangles may stray from a curved side, fraction of the diagonal of the mesh.
inline constexpr double kTrimTolerance = 2e-6;

// The length of edges that stray so far from a sphere.
double EdgeOnSphere(double radius, double diagonal);

}  // namespace rilievo
