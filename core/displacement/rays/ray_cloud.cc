#include "core/displacement/rays/ray_cloud.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 2048;
constexpr double kNoiseQuantile = 0.35;
constexpr int kNoiseRounds = 2;
// A point is an outlier when it stands off the median tangent plane of its neighbours by more than
// both: lengths in local spacings and in local noise.
constexpr float kStraySpacings = 0.8f;
constexpr float kStrayNoises = 5.0f;

// A neighbourhood and its point, with room for whole lanes.
constexpr int kLanes = 4;
using Values = std::array<float, (kMostNeighbors + 1 + kLanes - 1) / kLanes * kLanes>;

// The value below which `share` of the first `count` lie; reorders them. Of a few, each is
// compared with all: quicker than to part them again and again, where every turn is a guess.
float Quantile(Values& values, int count, double share) {
  const int rank = std::min(count - 1, static_cast<int>(share * count));
  constexpr int kFew = 20;
  if (count <= kFew) {
    std::fill_n(values.begin() + count, (kLanes - count % kLanes) % kLanes,
                std::numeric_limits<float>::infinity());
    for (int i = 0; i < count; ++i) {
      const float value = values[i];
      int below[kLanes] = {}, at_most[kLanes] = {};
      for (int j = 0; j < count; j += kLanes) {
        for (int lane = 0; lane < kLanes; ++lane) {
          below[lane] += values[j + lane] < value ? 1 : 0;
          at_most[lane] += values[j + lane] <= value ? 1 : 0;
        }
      }
      const int less = below[0] + below[1] + below[2] + below[3];
      const int not_more = at_most[0] + at_most[1] + at_most[2] + at_most[3];
      if (less <= rank && rank < not_more) return value;
    }
  }
  std::nth_element(values.begin(), values.begin() + rank, values.begin() + count);
  return values[rank];
}

// Signed distance of the point from the tangent planes of its neighbours, the median of them. Those
// that face away belong to the other side of a thin wall and are not asked.
float PlaneResidual(const OrientedCloud& cloud, const NeighborGraph& graph, int point) {
  Values distances;
  int count = 0;
  for (int neighbor : graph.neighbors(point)) {
    if (count == kMostNeighbors) break;
    if (cloud.normals.col(point).dot(cloud.normals.col(neighbor)) < 0) continue;
    const Eigen::Vector3d across = cloud.points.col(point) - cloud.points.col(neighbor);
    distances[count++] = static_cast<float>(cloud.normals.col(neighbor).dot(across));
  }
  return count == 0 ? 0.0f : Quantile(distances, count, 0.5);
}

absl::Status LowerNoise(const NeighborGraph& graph, const RunContext& context,
                        std::vector<float>* noise) {
  const std::vector<float> before = *noise;
  return ParallelFor(graph.size(), kBlock, context, [&](int64_t begin, int64_t end) {
    Values around;
    for (int64_t i = begin; i < end; ++i) {
      int count = 0;
      around[count++] = before[i];
      for (int neighbor : graph.neighbors(static_cast<int>(i))) {
        if (count <= kMostNeighbors) around[count++] = before[neighbor];
      }
      (*noise)[i] = Quantile(around, count, kNoiseQuantile);
    }
  });
}

}  // namespace

Ray MakeRay(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) {
  Ray ray;
  ray.origin = position.cast<float>();
  ray.direction = normal.cast<float>();
  ray.u = ray.direction.unitOrthogonal();
  ray.v = ray.direction.cross(ray.u);
  return ray;
}

absl::StatusOr<RayCloud> PrepareRayCloud(const OrientedCloud& cloud, const NeighborGraph& graph,
                                         const RunContext& context) {
  const int64_t count = cloud.points.cols();
  RayCloud result;
  result.points.resize(count);
  std::vector<float> noise = cloud.noise;
  for (int round = 0; round < kNoiseRounds; ++round) {
    RILIEVO_RETURN_IF_ERROR(LowerNoise(graph, context, &noise));
  }
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      RayPoint& point = result.points[i];
      for (int axis = 0; axis < 3; ++axis) {
        point.position[axis] = static_cast<float>(cloud.points(axis, i));
        point.normal[axis] = static_cast<float>(cloud.normals(axis, i));
      }
      point.spacing = cloud.spacing[i];
      point.noise = noise[i];
      const float off = std::abs(PlaneResidual(cloud, graph, static_cast<int>(i)));
      // Written so that a stand-off that is not a number marks an outlier too.
      if (!(off <= std::max(kStraySpacings * point.spacing, kStrayNoises * point.noise))) {
        for (float& component : point.normal) component = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }));
  for (const RayPoint& point : result.points) result.outliers += std::isnan(point.normal[0]);
  return result;
}

}  // namespace rilievo
