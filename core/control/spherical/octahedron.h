// The octahedron of directions, refined by midpoints: the lattice of SphericalControlMesh().
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// 8 * 4^levels faces, 4 * 4^levels + 2 vertices, all on the unit sphere around the origin,
// counter-clockwise seen from outside. Midpoints are pushed out to the sphere at each level, which
// keeps the areas of the faces within a factor of about two.
class Octahedron {
 public:
  // `levels` in [0, 8].
  explicit Octahedron(int levels);

  int levels() const { return static_cast<int>(faces_.size()) - 1; }
  const Eigen::Matrix3Xd& directions() const { return directions_; }
  const Eigen::Matrix3Xi& faces() const { return faces_.back(); }

  // The face that the ray from the origin along `direction` pierces.
  int FaceOf(const Eigen::Vector3d& direction) const;

 private:
  void Refine();

  Eigen::Matrix3Xd directions_;          // unit length
  std::vector<Eigen::Matrix3Xi> faces_;  // per level; children of face f: 4 f .. 4 f + 3
};

}  // namespace rilievo
