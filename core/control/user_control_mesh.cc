#include "core/control/user_control_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/control/control_options.h"
#include "core/control/settings.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

// Share of the columns of `from` that lie within kUserControlMesh.near of what the tree holds.
double NearShare(const Eigen::Matrix3Xd& from, const ClosestPointTree& to) {
  const auto columns = from.colwise();
  const auto near = std::count_if(columns.begin(), columns.end(), [&](const auto& place) {
    return to.HasWithin(place, kUserControlMesh.near);
  });
  return static_cast<double>(near) / static_cast<double>(from.cols());
}

absl::Status CheckNear(const ControlMesh& mesh, const OrientedCloud& cloud,
                       const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree surface,
                           ClosestPointTree::Over(mesh.vertices, mesh.faces, context));
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree points,
                           ClosestPointTree::Over(cloud.points, {}, context));
  const double points_near = NearShare(cloud.points, surface);
  const double mesh_near = NearShare(mesh.vertices, points);
  if (std::min(points_near, mesh_near) >= kUserControlMesh.least_near_share)
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "user_mesh: %.0f %% of the points are within a quarter of the diagonal of the mesh and %.0f "
      "%% of its vertices are within that of the points; both must be at least %.0f %%: is the "
      "mesh in "
      "the coordinates of the scan?",
      100 * points_near, 100 * mesh_near, 100 * kUserControlMesh.least_near_share));
}

// No vertex may lie so far off that the frame of the scan cannot hold it.
absl::Status CheckFar(const ControlMesh& mesh, const OrientedCloud& cloud) {
  const Eigen::Vector3d center = cloud.points.rowwise().mean();
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    const double distance = (mesh.vertices.col(v) - center).norm();
    if (distance <= kUserControlMesh.farthest) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "user_mesh: vertex %d lies %.0f diagonals of the scan away from it; at most "
        "%.0f are allowed",
        v, distance, kUserControlMesh.farthest));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> CheckUserControlMesh(const ControlMesh& mesh,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (mesh.faces.cols() < 1 || mesh.faces.cols() > kControlOptions.most_control_faces) {
    return absl::InvalidArgumentError(
        absl::StrCat("user_mesh: ", mesh.faces.cols(), " faces; between 1 and ",
                     kControlOptions.most_control_faces, " are allowed"));
  }
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    if (!mesh.vertices.col(v).allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("user_mesh: vertex ", v, " is not finite"));
    }
  }
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  if (!topology.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("user_mesh: no orientable 2-manifold: ", topology.status().message()));
  }
  const auto most = std::max_element(topology->valence.begin(), topology->valence.end());
  if (*most > kUserControlMesh.most_valence) {
    return absl::InvalidArgumentError(absl::StrCat(
        "user_mesh: vertex ", most - topology->valence.begin(), " has ", *most, " edges; at most ",
        kUserControlMesh.most_valence, " are allowed: split its faces"));
  }
  if (const auto creases = BuildCreaseTopology(mesh, *topology); !creases.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("user_mesh: ", creases.status().message()));
  }
  RILIEVO_RETURN_IF_ERROR(CheckNear(mesh, cloud, context));
  RILIEVO_RETURN_IF_ERROR(CheckFar(mesh, cloud));
  return mesh;
}

}  // namespace rilievo
