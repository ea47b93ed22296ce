#include "core/surface/signed_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"
#include "core/surface/triangle_distance.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

}  // namespace

absl::StatusOr<SignedDistance> SignedDistance::Build(TriangleMesh mesh, int children_per_face,
                                                     const RunContext& context) {
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("there are no triangles to measure a distance from");
  }
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh has a coordinate that is not finite");
  }
  SignedDistance made;
  RILIEVO_ASSIGN_OR_RETURN(made.tree_, ClosestPointTree::Build(mesh.vertices, mesh.triangles,
                                                               context, children_per_face));
  made.triangle_normals_.resize(3, mesh.triangles.cols());
  made.vertex_normals_ = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto corners = mesh.triangles.col(t);
    const auto side = [&](int k) -> Vector3d {
      return (mesh.vertices.col(corners[(k + 1) % 3]) - mesh.vertices.col(corners[k])).normalized();
    };
    const Vector3d sides[3] = {side(0), side(1), side(2)};
    const Vector3d normal = sides[0].cross(sides[1]).normalized();
    made.triangle_normals_.col(t) = normal;
    for (int k = 0; k < 3; ++k) {
      const double cosine = std::clamp(-sides[k].dot(sides[(k + 2) % 3]), -1.0, 1.0);
      made.vertex_normals_.col(corners[k]) += std::acos(cosine) * normal;
    }
  }
  made.edge_normals_.resize(3, 3 * mesh.triangles.cols());
  ForEachEdge(mesh.triangles, static_cast<int>(mesh.vertices.cols()),
              [&](int, int, const HalfEdgeGroup& group) {
                Vector3d sum = Vector3d::Zero();
                for (size_t i = 0; i < group.size(); ++i) {
                  sum += made.triangle_normals_.col(group[i] / 3);
                }
                for (size_t i = 0; i < group.size(); ++i) made.edge_normals_.col(group[i]) = sum;
              });
  made.mesh_ = std::move(mesh);
  return made;
}

Vector3d SignedDistance::NormalAt(int triangle, const Vector3d& weights) const {
  constexpr double kOnEdge = 1e-12;
  const bool zero[3] = {weights[0] < kOnEdge, weights[1] < kOnEdge, weights[2] < kOnEdge};
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    if (zero[next] && zero[last]) return vertex_normals_.col(mesh_.triangles(k, triangle));
  }
  for (int k = 0; k < 3; ++k) {  // half-edge k runs from corner k to the next
    if (zero[(k + 2) % 3]) return edge_normals_.col(3 * Eigen::Index{triangle} + k);
  }
  return triangle_normals_.col(triangle);
}

absl::StatusOr<std::vector<double>> SignedDistance::Of(const Eigen::Matrix3Xd& places,
                                                       const RunContext& context) const {
  std::vector<double> distances(static_cast<size_t>(places.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(places.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t i = begin; i < end; ++i) {
          const Vector3d place = places.col(i);
          double& distance = distances[static_cast<size_t>(i)];
          distance = std::numeric_limits<double>::quiet_NaN();
          if (!place.allFinite()) continue;
          const ClosestPointTree::Hit hit = tree_.Closest(place, hint);
          hint = hit.item;
          const int triangle = tree_.source()[hit.item];
          const auto corners = mesh_.triangles.col(triangle);
          const Vector3d a = mesh_.vertices.col(corners[0]), b = mesh_.vertices.col(corners[1]),
                         c = mesh_.vertices.col(corners[2]);
          const Vector3d weights = ClosestWeights(place, a, b, c);
          const Vector3d foot = weights[0] * a + weights[1] * b + weights[2] * c;
          const double side = (place - foot).dot(NormalAt(triangle, weights));
          distance = std::copysign(std::sqrt(hit.squared_distance), side);
        }
      }));
  return distances;
}

}  // namespace rilievo
