#include "core/surface/count_folds.h"

#include <Eigen/Geometry>
#include <atomic>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

bool IsTurnedOver(const Eigen::Vector3i& face, const Eigen::Matrix3Xd& displaced,
                  const LimitSurface& limit) {
  const auto edge = [&](const Eigen::Matrix3Xd& vertices, int k) -> Eigen::Vector3d {
    return vertices.col(face[(k + 1) % 3]) - vertices.col(face[k]);
  };
  const Eigen::Vector3d normal = edge(displaced, 0).cross(edge(displaced, 1));
  const Eigen::Vector3d along =
      limit.normals.col(face[0]) + limit.normals.col(face[1]) + limit.normals.col(face[2]);
  if (normal.dot(along) < 0) return true;
  for (int k = 0; k < 3; ++k) {
    if (edge(displaced, k).dot(edge(limit.positions, k)) >= 0) return false;
  }
  return true;
}

}  // namespace

absl::StatusOr<int64_t> CountFolds(const LimitSurface& limit, const Eigen::Matrix3Xd& vertices,
                                   const Eigen::Matrix3Xi& triangles, const RunContext& context) {
  std::atomic<int64_t> folds = 0;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(triangles.cols(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        int64_t here = 0;
        for (int64_t f = begin; f < end; ++f) {
          here += IsTurnedOver(triangles.col(f), vertices, limit);
        }
        folds += here;
      }));
  return folds.load();
}

}  // namespace rilievo
