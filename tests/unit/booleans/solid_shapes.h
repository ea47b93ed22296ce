// Solids to combine, and what is asked of a result.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <string>

#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/mass_properties.h"
#include "tests/unit/voxels/closed_meshes.h"

namespace rilievo {

inline TriangleMesh UnitBox(double x, double y, double z) {
  return BoxMesh({x, y, z}, {x + 1, y + 1, z + 1});
}

inline Eigen::Affine3d By(double x, double y, double z) {
  return Eigen::Affine3d(Eigen::Translation3d(x, y, z));
}

inline double VolumeOf(const TriangleMesh& mesh) {
  return MassPropertiesOf(mesh.vertices, mesh.triangles)->volume;
}

// Corners on an integer grid of `steps` to a side.
inline TriangleMesh RandomTetrahedron(int steps, std::mt19937_64& random) {
  std::uniform_int_distribution<int> step(0, steps);
  for (;;) {
    std::vector<Eigen::Vector3d> p(4);
    for (Eigen::Vector3d& corner : p) {
      for (double& x : corner) x = step(random);
    }
    const double volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
    if (volume == 0) continue;
    if (volume < 0) std::swap(p[0], p[1]);
    return MeshOf(p, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
  }
}

inline Eigen::Affine3d RandomPose(double reach, std::mt19937_64& random) {
  std::uniform_real_distribution<double> at(-reach, reach);
  std::normal_distribution<double> normal;
  Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
  Eigen::Affine3d pose(turn.normalized());
  pose.translation() << at(random), at(random), at(random);
  return pose;
}

}  // namespace rilievo
