// Normals of a triangle mesh from its own triangles.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// Area-weighted unit normal of each vertex (column); +z where all faces around it are degenerate.
Eigen::Matrix3Xd VertexNormals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces);

}  // namespace rilievo
