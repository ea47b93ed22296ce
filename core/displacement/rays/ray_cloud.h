// The points as the sampler walks over them: one 32-byte record a point, outliers marked.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Position and outward unit normal, unit frame. The normal of an outlier (a point that stands off
// the surface its neighbours describe) is NaN, so that no agreement test lets it into a queue.
struct RayPoint {
  float position[3];
  float normal[3];
  float spacing;  // local distance between samples
  float noise;    // local noise of the scan, without the share that sharp edges add
};

struct RayCloud {
  std::vector<RayPoint> points;
  int outliers = 0;
};

// The normal ray (a full line) of one domain vertex with a frame across it: u x v = direction.
struct Ray {
  Eigen::Vector3f origin, direction, u, v;
};
Ray MakeRay(const Eigen::Vector3d& position, const Eigen::Vector3d& normal);

// A residual to a local quadric is large on sharp edges as well as under noise, but edges are
// thin while the noise of a scanner changes slowly: two rounds of a lower quantile over the
// neighbours leave the noise alone.
absl::StatusOr<RayCloud> PrepareRayCloud(const OrientedCloud& cloud, const NeighborGraph& graph,
                                         const RunContext& context);

}  // namespace rilievo
