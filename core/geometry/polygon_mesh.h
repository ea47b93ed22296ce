// Polygons as a plain value.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Face f has the corners [begin[f], begin[f + 1]), counter-clockwise seen from outside; indices are
// columns of `vertices`.
struct PolygonMesh {
  Eigen::Matrix3Xd vertices;  // column = position
  std::vector<int> begin = {0};
  std::vector<int> corners;

  int face_count() const { return static_cast<int>(begin.size()) - 1; }
  std::span<const int> Face(int f) const {
    const auto at = static_cast<size_t>(f);
    return std::span(corners).subspan(static_cast<size_t>(begin[at]),
                                      static_cast<size_t>(begin[at + 1] - begin[at]));
  }
  void AddFace(std::span<const int> face) {
    corners.insert(corners.end(), face.begin(), face.end());
    begin.push_back(static_cast<int>(corners.size()));
  }
  bool triangles() const { return corners.size() == 3 * (begin.size() - 1); }
};

// A fan from the first corner of each face.
inline TriangleMesh FansOf(const PolygonMesh& mesh) {
  TriangleMesh fans{mesh.vertices, {}, {}};
  fans.triangles.resize(
      3, static_cast<Eigen::Index>(mesh.corners.size()) - Eigen::Index{2} * mesh.face_count());
  Eigen::Index column = 0;
  for (int f = 0; f < mesh.face_count(); ++f) {
    const std::span<const int> face = mesh.Face(f);
    for (size_t i = 2; i < face.size(); ++i) {
      fans.triangles.col(column++) << face[0], face[i - 1], face[i];
    }
  }
  return fans;
}

}  // namespace rilievo
