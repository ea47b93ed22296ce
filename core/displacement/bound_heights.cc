#include "core/displacement/bound_heights.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

constexpr float kFoldMargin = 0.9f;
// Below this curvature the option's bound, at most 0.5, is the smaller one.
constexpr float kLeastCurvature = 1e-6f;

}  // namespace

std::vector<HeightBounds> BoundHeights(const MeshTopology& topology, const LimitSurface& limit,
                                       double max_height) {
  std::vector<float> most(topology.vertex_count, 0.0f), least(topology.vertex_count, 0.0f);
  for (const auto& edge : topology.edge_vertices.colwise()) {
    const Eigen::Vector3d along = limit.positions.col(edge[1]) - limit.positions.col(edge[0]);
    const double square = along.squaredNorm();
    if (!(square > 0)) continue;
    const Eigen::Vector3d turn = limit.normals.col(edge[1]) - limit.normals.col(edge[0]);
    const float curvature = static_cast<float>(turn.dot(along) / square);
    for (int vertex : {edge[0], edge[1]}) {
      most[vertex] = std::max(most[vertex], curvature);
      least[vertex] = std::min(least[vertex], curvature);
    }
  }
  // Rounded down, for the nearest float may lie above the double.
  const float most_height = std::nextafter(static_cast<float>(max_height), 0.0f);
  std::vector<HeightBounds> bounds(topology.vertex_count);
  for (int v = 0; v < topology.vertex_count; ++v) {
    bounds[v].lowest = -std::min(most_height, kFoldMargin / std::max(most[v], kLeastCurvature));
    bounds[v].highest = std::min(most_height, kFoldMargin / std::max(-least[v], kLeastCurvature));
  }
  return bounds;
}

}  // namespace rilievo
