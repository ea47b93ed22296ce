#include "core/surface/mass_properties.h"

#include <Eigen/Geometry>

#include "absl/status/status.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The integrals of 1, x and x x^T over a body.
struct Moments {
  double mass = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
};

// Adds a triangle, or the tetrahedron of it and the origin: with the corners a, b, c and their sum
// s (the origin adds nothing) the first moment is mass s / n, the second mass (a a^T + b b^T + c
// c^T + s s^T) / (n (n + 1)), n corners.
void Add(const Vector3d& a, const Vector3d& b, const Vector3d& c, double mass, int corners,
         Moments& moments) {
  const Vector3d sum = a + b + c;
  moments.mass += mass;
  moments.first += mass / corners * sum;
  moments.second +=
      mass / (corners * (corners + 1)) *
      (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
}

// About the centroid.
Matrix3d InertiaOf(const Moments& moments, const Vector3d& centroid) {
  const Matrix3d central = moments.second - moments.mass * centroid * centroid.transpose();
  return central.trace() * Matrix3d::Identity() - central;
}

}  // namespace

absl::StatusOr<MassProperties> MassPropertiesOf(const Eigen::Matrix3Xd& vertices,
                                                const Eigen::Matrix3Xi& triangles) {
  if (triangles.cols() == 0) {
    return absl::InvalidArgumentError("there are no triangles, so no area and no volume");
  }
  if (!vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh has a coordinate that is not finite");
  }
  const TopologySummary topology = SummarizeTopology(triangles, static_cast<int>(vertices.cols()));
  MassProperties result;
  result.closed = topology.boundary_edges == 0;
  const Vector3d low = vertices.rowwise().minCoeff(), high = vertices.rowwise().maxCoeff();
  const Vector3d origin = low + (high - low) / 2;
  Moments shell, solid;
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    const Vector3d a = vertices.col(triangles(0, t)) - origin,
                   b = vertices.col(triangles(1, t)) - origin,
                   c = vertices.col(triangles(2, t)) - origin;
    Add(a, b, c, (b - a).cross(c - a).norm() / 2, 3, shell);
    if (result.closed) Add(a, b, c, a.dot(b.cross(c)) / 6, 4, solid);
  }
  result.area = shell.mass;
  result.volume = solid.mass;
  const Moments& body = result.closed && solid.mass != 0 ? solid : shell;
  if (body.mass == 0) return result;
  const Vector3d centroid = body.first / body.mass;
  result.centroid = origin + centroid;
  result.inertia = InertiaOf(body, centroid);
  return result;
}

}  // namespace rilievo
