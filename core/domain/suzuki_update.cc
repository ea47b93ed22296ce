#include "core/domain/suzuki_update.h"

#include <cstdint>
#include <vector>

#include "core/domain/settings.h"
#include "core/geometry/vertex_ring.h"

namespace rilievo {
namespace {

void FillMoves(const VertexRings& rings, const std::vector<int>& without_data,
               Eigen::Matrix3Xd* moves) {
  for (int sweep = 0; sweep < kSuzukiUpdate.fill_sweeps; ++sweep) {
    const Eigen::Matrix3Xd before = *moves;
    for (int vertex : without_data) {
      const std::span<const int> ring = RingOf(rings, vertex);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const int other : ring) mean += before.col(other);
      moves->col(vertex) = mean / static_cast<double>(ring.size());
    }
  }
}

}  // namespace

void SuzukiUpdate(const DomainSamples& samples, const FootPoints& foot_points, double lambda,
                  Eigen::Matrix3Xd* control_points) {
  const int count = samples.control_vertex_count();
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, count);
  std::vector<int> without_data;
  for (int i = 0; i < count; ++i) {
    const auto s = static_cast<size_t>(i);
    const bool sharp = samples.is_sharp(i) && !samples.on_boundary(i);
    const Eigen::Vector3d way =
        sharp ? Eigen::Vector3d(foot_points.sharp_moves.col(samples.sharp_slot[s]))
              : foot_points.offset[s] * foot_points.normals.col(i);
    moves.col(i) = lambda * (foot_points.weight[s] * way +
                             foot_points.border_offset[s] * foot_points.conormals.col(i));
    if (foot_points.weight[s] == 0 && foot_points.border_weight[s] == 0) without_data.push_back(i);
  }
  if (!without_data.empty()) FillMoves(samples.control_rings, without_data, &moves);
  *control_points += moves;
}

}  // namespace rilievo
