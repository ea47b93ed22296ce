#include "core/control/simplify/uncovered_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/simplify/settings.h"
#include "core/geometry/vertex_normals.h"
#include "core/loop/refinement.h"
#include "core/points/settings.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// A triangulated surface.
struct Triangles {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi faces;
  int children_per_face = 0;  // triangles of a control face, which follow each other

  Vector3d NormalOf(int face) const { return FaceCross(vertices, faces, face).normalized(); }
};

// The Loop surface whose limits at the control vertices are the vertices of `mesh`, nearly: a few
// rounds of moving each control point by what its limit is off (Maekawa, Matsumoto, Namiki 2007).
absl::StatusOr<Triangles> SurfaceOf(const ControlMesh& mesh, const RunContext& context) {
  const int level = 16 * mesh.faces.cols() <= kUncoveredPoints.most_triangles ? 2 : 1;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement, RefineToVertices(mesh, level, context));
  Eigen::Matrix3Xd points = mesh.vertices;
  for (int round = 0; round < kUncoveredPoints.interpolation_rounds; ++round) {
    RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                             EvaluateLimit(refinement, points, 0, context));
    points += mesh.vertices - limit.positions;
  }
  RILIEVO_ASSIGN_OR_RETURN(LimitSurface limit, EvaluateLimit(refinement, points, level, context));
  return Triangles{std::move(limit.positions), FinestFaces(refinement), 1 << (2 * level)};
}

// Of the normals of the surface at the place nearest to `point`, the cosine of the one most like
// `normal`. On an edge or at a corner the triangles of all its sides are as near: one of them
// alone, which would be taken by chance, may face away from a point that lies straight above
// another.
double BestCosine(const Triangles& surface, const ClosestPointTree& tree, const Vector3d& point,
                  const Vector3d& normal) {
  std::array<ClosestPointTree::Hit, 16> hits;  // the valence of few vertices is more
  const int count = tree.Nearest(point, hits);
  double best = -1;
  for (int k = 0; k < count; ++k) {
    if (hits[k].squared_distance > (1 + kCommon.rounding) * hits[0].squared_distance) break;
    best = std::max(best, surface.NormalOf(tree.source()[hits[k].item]).dot(normal));
  }
  return best;
}

// How far off the surface a point still is in reach.
struct Reach {
  double distance;
  bool of_noise;  // what its noise explains, not its spacing
};

Reach ReachOf(const OrientedCloud& cloud, int64_t point, const CoverageLimits& limits) {
  const double spacing =
      limits.spacings * std::max<double>(cloud.spacing[point], cloud.median_spacing);
  const double noise = limits.noises * std::max<double>(cloud.noise[point], cloud.median_noise);
  return {std::max(spacing, noise), noise > spacing};
}

}  // namespace

absl::StatusOr<UncoveredPoints> FindUncoveredPoints(const OrientedCloud& cloud,
                                                    const ControlMesh& control,
                                                    const CoverageLimits& limits,
                                                    const RunContext& context) {
  if (cloud.points.cols() == 0) return UncoveredPoints{};
  RILIEVO_ASSIGN_OR_RETURN(const Triangles surface, SurfaceOf(control, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const ClosestPointTree tree,
      ClosestPointTree::Over(surface.vertices, surface.faces, context, surface.children_per_face));
  const int64_t most = kUncoveredPoints.points_per_face * control.faces.cols();
  const int64_t stride = (cloud.points.cols() + most - 1) / most;  // along a Morton curve
  constexpr int kNone = -1;                                        // in reach
  std::vector<int> face_of(static_cast<size_t>((cloud.points.cols() + stride - 1) / stride));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(face_of.size()), kLightBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t k = begin; k < end; ++k) {
          face_of[k] = kNone;
          const Vector3d point = cloud.points.col(k * stride);
          const double reach = ReachOf(cloud, k * stride, limits).distance, squared = reach * reach;
          if (hint >= 0 && tree.SquaredDistanceTo(hint, point) <= squared) continue;
          const ClosestPointTree::Hit hit = tree.Closest(point, hint);
          hint = hit.item;
          if (hit.squared_distance <= squared) continue;
          if (BestCosine(surface, tree, point, cloud.normals.col(k * stride)) < limits.cosine) {
            face_of[k] = tree.source()[hit.item] / surface.children_per_face;
          }
        }
      }));
  std::vector<int> points_of(static_cast<size_t>(control.faces.cols()));
  for (const int face : face_of) {
    if (face != kNone) ++points_of[face];
  }
  UncoveredPoints lost;
  std::vector<uint8_t> counted(points_of.size());
  for (size_t k = 0; k < face_of.size(); ++k) {
    const int face = face_of[k];
    const int64_t point = static_cast<int64_t>(k) * stride;
    if (face == kNone) continue;
    if (points_of[face] < kUncoveredPoints.fewest_noisy && ReachOf(cloud, point, limits).of_noise)
      continue;
    lost.points.push_back(cloud.points.col(point));
    lost.faces += counted[face] == 0;
    counted[face] = 1;
  }
  return lost;
}

}  // namespace rilievo
