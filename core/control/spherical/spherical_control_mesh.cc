#include "core/control/spherical/spherical_control_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/control/control_options.h"
#include "core/control/planar/harmonic_fill.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/planar/settings.h"
#include "core/control/planar/sheet_test.h"
#include "core/control/settings.h"
#include "core/control/spherical/octahedron.h"
#include "core/control/spherical/settings.h"
#include "core/control/spherical/star_shape.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

absl::Status CheckServes(const OrientedCloud& cloud, const Vector3d& center,
                         const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const StarCheck check, CheckStarShape(cloud, center, context));
  if (check.single_sheet < kSheetTest.least_single_sheet) {
    return absl::FailedPreconditionError(
        absl::StrFormat("topology spherical cannot serve: %.0f %% of the rays from the centre meet "
                        "the surface more "
                        "than once (at most %.0f %% can be borne); topology arbitrary would serve",
                        100 * (1 - check.single_sheet), 100 * (1 - kSheetTest.least_single_sheet)));
  }
  if (check.coverage < kSphericalControlMesh.least_coverage) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "topology spherical cannot serve: rays from the centre meet points in %.0f %% of the "
        "directions (at least %.0f %% are needed); topology arbitrary would serve",
        100 * check.coverage, 100 * kSphericalControlMesh.least_coverage));
  }
  const double one_sided = std::max(check.outward, 1 - check.outward);
  if (one_sided < kSheetTest.least_single_sheet) {
    return absl::FailedPreconditionError(
        absl::StrFormat("topology spherical cannot serve: %.0f %% of the surface turns its other "
                        "side to the centre (at most %.0f %% can be borne); topology arbitrary "
                        "would serve",
                        100 * (1 - one_sided), 100 * (1 - kSheetTest.least_single_sheet)));
  }
  return absl::OkStatus();
}

// Weighted points seen from a vertex' ray.
struct Hit {
  int vertex;
  float radius;
  float weight;
};

// The mean radius of the hits about their weighted median: a second sheet or an outlier has no say.
double RobustRadius(const Hit* begin, const Hit* end, double edge_angle) {
  double all = 0;
  for (const Hit* hit = begin; hit != end; ++hit) all += hit->weight;
  double median = begin->radius, below = 0;
  for (const Hit* hit = begin; hit != end && below < all / 2; ++hit) {
    median = hit->radius;
    below += hit->weight;
  }
  const double reach = 2 * edge_angle * median;
  double sum = 0, weight = 0;
  for (const Hit* hit = begin; hit != end; ++hit) {
    if (std::abs(hit->radius - median) > reach) continue;
    sum += double{hit->weight} * hit->radius;
    weight += hit->weight;
  }
  return weight > 0 ? sum / weight : median;
}

// Each point speaks to the corners of the face its ray pierces, by its barycentric weights.
std::vector<Hit> CollectHits(const OrientedCloud& cloud, const Vector3d& center,
                             const Octahedron& octahedron) {
  std::vector<Hit> hits;
  hits.reserve(3 * static_cast<size_t>(cloud.points.cols()));
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const Vector3d ray = cloud.points.col(i) - center;
    const double radius = ray.norm();
    if (!(radius > 0)) continue;
    const Eigen::Vector3i face = octahedron.faces().col(octahedron.FaceOf(ray));
    const Vector3d a = octahedron.directions().col(face[0]);
    const Vector3d b = octahedron.directions().col(face[1]);
    const Vector3d c = octahedron.directions().col(face[2]);
    const Vector3d share(ray.dot(b.cross(c)), ray.dot(c.cross(a)), ray.dot(a.cross(b)));
    const double sum = share.sum();
    if (!(sum > 0)) continue;
    for (int k = 0; k < 3; ++k) {
      const double weight = PointArea(cloud, i) * std::max(0.0, share[k] / sum);
      if (weight > 0) {
        hits.push_back({face[k], static_cast<float>(radius), static_cast<float>(weight)});
      }
    }
  }
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    if (a.vertex != b.vertex) return a.vertex < b.vertex;
    return a.radius != b.radius ? a.radius < b.radius : a.weight < b.weight;
  });
  return hits;
}

int LevelsFor(int target_faces) {
  const double steps =
      std::log2(std::clamp(target_faces, 8, kControlOptions.most_control_faces) / 8.0) / 2;
  return std::max(static_cast<int>(std::lround(steps)), 1);
}

}  // namespace

int SphericalControlFaces(int target_faces) { return 8 << (2 * LevelsFor(target_faces)); }

absl::StatusOr<ControlMesh> SphericalControlMesh(const OrientedCloud& cloud, int target_faces,
                                                 const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  const Vector3d center = FindStarCenter(cloud);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  RILIEVO_RETURN_IF_ERROR(CheckServes(cloud, center, context));
  context.Report(Stage::kControlMesh, 0.4);

  const Octahedron octahedron(LevelsFor(target_faces));
  const std::vector<Hit> hits = CollectHits(cloud, center, octahedron);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  const auto vertex_count = static_cast<size_t>(octahedron.directions().cols());
  const double edge_angle = std::sqrt(4 * 4 * std::numbers::pi / std::numbers::sqrt3 /
                                      static_cast<double>(octahedron.faces().cols()));
  std::vector<uint8_t> known(vertex_count, 0);
  Eigen::VectorXd radii = Eigen::VectorXd::Zero(static_cast<int64_t>(vertex_count));
  for (size_t begin = 0, end = 0; begin < hits.size(); begin = end) {
    for (end = begin + 1; end < hits.size() && hits[end].vertex == hits[begin].vertex;) ++end;
    const int vertex = hits[begin].vertex;
    radii[vertex] = RobustRadius(hits.data() + begin, hits.data() + end, edge_angle);
    known[vertex] = 1;
  }
  HarmonicFill(octahedron.faces(), known, &radii);
  ControlMesh mesh;
  mesh.faces = octahedron.faces();
  mesh.vertices = (octahedron.directions() * radii.asDiagonal()).colwise() + center;
  return mesh;
}

}  // namespace rilievo
