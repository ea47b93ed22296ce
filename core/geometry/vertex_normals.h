// Normals of a triangle mesh from its own triangles.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// Along the normal of a face, twice as long as its area.
Eigen::Vector3d FaceCross(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces,
                          Eigen::Index face);

// Area-weighted unit normal of each vertex (column); +z where all faces around it are degenerate.
Eigen::Matrix3Xd VertexNormals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces);

}  // namespace rilievo
