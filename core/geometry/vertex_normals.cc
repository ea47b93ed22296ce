#include "core/geometry/vertex_normals.h"

#include <Eigen/Geometry>

namespace rilievo {

Eigen::Vector3d FaceCross(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces,
                          Eigen::Index face) {
  const Eigen::Vector3d a = vertices.col(faces(0, face));
  return (vertices.col(faces(1, face)) - a).cross(vertices.col(faces(2, face)) - a);
}

Eigen::Matrix3Xd VertexNormals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  for (int f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3d area_normal = FaceCross(vertices, faces, f);
    for (int k = 0; k < 3; ++k) normals.col(faces(k, f)) += area_normal;
  }
  for (int v = 0; v < normals.cols(); ++v) {
    const double length = normals.col(v).norm();
    normals.col(v) = length > 0 ? Eigen::Vector3d(normals.col(v) / length)
                                : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  }
  return normals;
}

}  // namespace rilievo
