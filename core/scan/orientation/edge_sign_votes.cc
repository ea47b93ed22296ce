#include "core/scan/orientation/edge_sign_votes.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// The normal of one end, reflected at the bisector plane of the chord, is the normal of the other
// when both lie on a circular arc: exact on flat parts, on round ones and at sharp edges (Xie et
// al. 2003; Koenig and Gumhold 2009). Heights that noise explains count as none. Where the two
// planes are apart along their mean normal, as they are on no arc, by more than noise and the
// length of the chord explain, the ends may lie on two sheets or on the two sides of one, and tell
// little.
double SignVote(const OrientedCloud& cloud, int a, int b) {
  constexpr double kNoises = 3;
  constexpr double kUsualStep = 0.15;  // of the chord
  const Eigen::Vector3d chord = cloud.points.col(b) - cloud.points.col(a);
  const double squared = chord.squaredNorm();
  const double cosine = cloud.normals.col(a).dot(cloud.normals.col(b));
  if (!(squared > 0)) return cosine;
  const double height_a = chord.dot(cloud.normals.col(a));
  const double height_b = chord.dot(cloud.normals.col(b));
  const double slack = kNoises * std::max(cloud.noise[a], cloud.noise[b]);
  const auto beyond_noise = [slack](double height) {
    return std::copysign(std::max(0.0, std::abs(height) - slack), height);
  };
  const double reflected = cosine - 2 * beyond_noise(height_a) * beyond_noise(height_b) / squared;
  const double apart = std::abs(height_a + std::copysign(1.0, cosine) * height_b) / 2;
  const double step = apart / (slack + kUsualStep * std::sqrt(squared));
  return std::clamp(reflected, -1.0, 1.0) / (1 + step * step * step * step);
}

}  // namespace

absl::StatusOr<std::vector<float>> EdgeSignVotes(const NeighborGraph& graph,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context) {
  std::vector<float> relations(graph.indices.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(graph.size(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t edge = begin * graph.k; edge < end * graph.k; ++edge) {
          relations[edge] = static_cast<float>(
              SignVote(cloud, static_cast<int>(edge / graph.k), graph.indices[edge]));
        }
      }));
  return relations;
}

}  // namespace rilievo
