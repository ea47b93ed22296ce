#include "core/control/user_control_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {
namespace {

// The fit holds the stencils of a face's vertices densely: their cost grows with the square of the
// valence.
constexpr int kMostValence = 64;
constexpr double kFarthest = 10;  // diagonals

using Eigen::Vector3d;

constexpr int kMostFaces = 200000;
constexpr double kNear = 0.25;  // of the diagonal
constexpr double kLeastNearShare = 0.5;
constexpr double kSampleStep = 0.05;  // of the diagonal, between samples of the mesh
constexpr int kMostStepsPerEdge = 20;
constexpr int kCloudSamples = 5000;

// Points of the mesh so dense that the nearest one tells the distance to kSampleStep.
Eigen::Matrix3Xd SampleMesh(const ControlMesh& mesh) {
  std::vector<Vector3d> samples;
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    const Vector3d a = mesh.vertices.col(mesh.faces(0, f));
    const Vector3d b = mesh.vertices.col(mesh.faces(1, f));
    const Vector3d c = mesh.vertices.col(mesh.faces(2, f));
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int steps = static_cast<int>(
        std::clamp(std::ceil(longest / kSampleStep), 1.0, double{kMostStepsPerEdge}));
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; i + j < steps; ++j) {
        const double s = (i + 1.0 / 3) / steps, t = (j + 1.0 / 3) / steps;
        samples.push_back((1 - s - t) * a + s * b + t * c);
      }
    }
  }
  Eigen::Matrix3Xd columns(3, static_cast<int64_t>(samples.size()));
  for (size_t i = 0; i < samples.size(); ++i) columns.col(static_cast<int64_t>(i)) = samples[i];
  return columns;
}

// Share of about kCloudSamples columns of `from` whose nearest column of `to` is within kNear.
absl::StatusOr<double> NearShare(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                 const RunContext& context) {
  const int64_t stride = std::max<int64_t>(1, from.cols() / kCloudSamples);
  const int64_t count = (from.cols() + stride - 1) / stride;
  Eigen::Matrix3Xd asked(3, count);
  for (int64_t i = 0; i < count; ++i) asked.col(i) = from.col(i * stride);
  const PointIndex index(to);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest, index.NearestOfEach(asked, context));
  int64_t near = 0;
  for (int64_t i = 0; i < count; ++i) {
    near += (to.col(nearest[i]) - asked.col(i)).norm() <= kNear ? 1 : 0;
  }
  return static_cast<double>(near) / static_cast<double>(count);
}

absl::Status CheckNear(const ControlMesh& mesh, const OrientedCloud& cloud,
                       const RunContext& context) {
  const Eigen::Matrix3Xd samples = SampleMesh(mesh);
  RILIEVO_ASSIGN_OR_RETURN(const double points_near, NearShare(cloud.points, samples, context));
  RILIEVO_ASSIGN_OR_RETURN(const double mesh_near, NearShare(samples, cloud.points, context));
  if (std::min(points_near, mesh_near) >= kLeastNearShare) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "user_mesh: %.0f %% of the points are within a quarter of the diagonal of the mesh and %.0f "
      "%% of the mesh is within that of the points; both must be at least %.0f %%: is the mesh in "
      "the coordinates of the scan?",
      100 * points_near, 100 * mesh_near, 100 * kLeastNearShare));
}

// No vertex may lie so far off that the frame of the scan cannot hold it.
absl::Status CheckFar(const ControlMesh& mesh, const OrientedCloud& cloud) {
  const Eigen::Vector3d center = cloud.points.rowwise().mean();
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    const double distance = (mesh.vertices.col(v) - center).norm();
    if (distance <= kFarthest) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "user_mesh: vertex %d lies %.0f diagonals of the scan away from it; at most "
        "%.0f are allowed",
        v, distance, kFarthest));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> CheckUserControlMesh(const ControlMesh& mesh,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (mesh.faces.cols() < 1 || mesh.faces.cols() > kMostFaces) {
    return absl::InvalidArgumentError(absl::StrCat(
        "user_mesh: ", mesh.faces.cols(), " faces; between 1 and ", kMostFaces, " are allowed"));
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
  if (*most > kMostValence) {
    return absl::InvalidArgumentError(
        absl::StrCat("user_mesh: vertex ", most - topology->valence.begin(), " has ", *most,
                     " edges; at most ", kMostValence, " are allowed: split its faces"));
  }
  RILIEVO_RETURN_IF_ERROR(CheckNear(mesh, cloud, context));
  RILIEVO_RETURN_IF_ERROR(CheckFar(mesh, cloud));
  return mesh;
}

}  // namespace rilievo
