#include "core/pipeline/domain_of_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "core/control/settings.h"
#include "core/control/user_control_mesh.h"
#include "core/geometry/half_edges.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

bool HasArea(const Shape& mesh) {
  for (const auto triangle : mesh.triangles.colwise()) {
    const Eigen::Vector3d origin = mesh.vertices.col(triangle[0]);
    const Eigen::Vector3d u = mesh.vertices.col(triangle[1]) - origin,
                          v = mesh.vertices.col(triangle[2]) - origin;
    if (!(u.cross(v).norm() > kDomainOfMesh.least_area)) return false;
  }
  return true;
}

}  // namespace

std::optional<ControlMesh> ControlMeshOfFewTriangles(const Shape& mesh, int64_t faces) {
  if (mesh.triangles.cols() == 0 || mesh.triangles.cols() >= faces || !HasArea(mesh)) return {};
  const auto count = static_cast<int>(mesh.vertices.cols());
  std::vector<int> triangles(static_cast<size_t>(count), 0), edges(triangles);
  for (const int corner : mesh.triangles.reshaped()) {
    if (++triangles[static_cast<size_t>(corner)] > kUserControlMesh.most_valence) return {};
  }
  ControlMesh control{mesh.vertices, mesh.triangles};
  ForEachEdge(mesh.triangles, count, [&](int low, int high, const HalfEdgeGroup& group) {
    ++edges[static_cast<size_t>(low)];
    ++edges[static_cast<size_t>(high)];
    if (group.size() == 2) control.creases.push_back({low, high});
  });
  for (int v = 0; v < count; ++v) {
    if (edges[static_cast<size_t>(v)] < kDomainOfMesh.sharp_edges_of_corner)
      control.corners.push_back(v);
  }
  std::sort(control.creases.begin(), control.creases.end(), [](const Crease& a, const Crease& b) {
    return a.a < b.a || (a.a == b.a && a.b < b.b);
  });
  return control;
}

}  // namespace rilievo
