// A ball with two prongs, which a coarse mesh easily cuts off or spans with a web.
#pragma once

#include <algorithm>

#include "core/geometry/vertex_normals.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {

inline double BallField(const Eigen::Vector3d& x) { return (x - kOffset).norm() - 0.25; }

// From the centre to (+-0.04, 0, 0.4), 0.012 in radius.
inline double ProngedBallField(const Eigen::Vector3d& x) {
  double field = BallField(x);
  for (const double side : {-0.04, 0.04}) {
    const Eigen::Vector3d tip(side, 0, 0.4);
    const double along = std::clamp(x.dot(tip) / tip.squaredNorm(), 0.0, 1.0);
    field = std::min(field, (x - along * tip).norm() - 0.012);
  }
  return field;
}

// The vertices of a mesh as a clean scan: their spacing that of as many spread evenly.
inline OrientedCloud CloudOf(const ControlMesh& mesh) {
  OrientedCloud cloud;
  cloud.points = mesh.vertices;
  cloud.normals = VertexNormals(mesh.vertices, mesh.faces);
  double area = 0;
  for (const auto& face : mesh.faces.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    area += (mesh.vertices.col(face[1]) - a).cross(mesh.vertices.col(face[2]) - a).norm() / 2;
  }
  const auto count = static_cast<size_t>(cloud.points.cols());
  cloud.median_spacing = std::sqrt(area / static_cast<double>(count));
  cloud.spacing.assign(count, static_cast<float>(cloud.median_spacing));
  cloud.noise.assign(count, 0.0f);
  cloud.median_noise = 0;
  return cloud;
}

}  // namespace rilievo
