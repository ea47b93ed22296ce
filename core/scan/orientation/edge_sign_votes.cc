#include "core/scan/orientation/edge_sign_votes.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/orientation/settings.h"

namespace rilievo {
namespace {

// How two points with their planes lie to each other.
struct Pair {
  double cosine = 0;  // of the normals
  Eigen::Vector3d chord;
  double height_a = 0;  // of the chord over the plane at either end
  double height_b = 0;
  double slack = 0;  // what noise explains of a height
};

Pair PairOf(const OrientedCloud& cloud, int a, int b) {
  Pair pair;
  pair.chord = cloud.points.col(b) - cloud.points.col(a);
  pair.cosine = cloud.normals.col(a).dot(cloud.normals.col(b));
  pair.height_a = pair.chord.dot(cloud.normals.col(a));
  pair.height_b = pair.chord.dot(cloud.normals.col(b));
  pair.slack = kCommon.noise_deviations * std::max(cloud.noise[a], cloud.noise[b]);
  return pair;
}

// The distance of two parallel planes along their mean normal: none on any arc.
double StepHeight(const Pair& pair) {
  return std::abs(pair.height_a + std::copysign(1.0, pair.cosine) * pair.height_b) / 2;
}

bool IsStep(const Pair& pair, double spacing) {
  return std::abs(pair.cosine) > kCommon.smooth_cosine &&
         StepHeight(pair) > std::max(1.2 * pair.slack, kEdgeSignVotes.sheet_spacings * spacing);
}

double PairSpacing(const OrientedCloud& cloud, int a, int b) {
  return std::min(cloud.spacing[a], cloud.spacing[b]);
}

// In [0, 1]: 1 when the points beyond a step lie all around, as the far side of a thin wall does,
// near 0 when on one side only, as behind the edge of a stair, or when there are next to none.
float Overlap(const OrientedCloud& cloud, int a, std::span<const int> around) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  const Eigen::Vector3d normal = cloud.normals.col(a);
  for (const int b : around) {
    const Pair pair = PairOf(cloud, a, b);
    if (!IsStep(pair, PairSpacing(cloud, a, b))) continue;
    sum += (pair.chord - pair.height_a * normal).normalized();
    ++count;
  }
  return count < kCommon.fewest_witnesses ? 0.0f : static_cast<float>(1 - sum.norm() / count);
}

// The normal of one end, reflected at the bisector plane of the chord, is the normal of the other
// when both lie on a circular arc: exact on flat parts, on round ones and at sharp edges (Xie et
// al. 2003; Koenig and Gumhold 2009). Heights that noise explains count as none.
double ReflectedCosine(const Pair& pair) {
  const auto beyond_noise = [&pair](double height) {
    return std::copysign(std::max(0.0, std::abs(height) - pair.slack), height);
  };
  const double squared = pair.chord.squaredNorm();
  if (!(squared > 0)) return pair.cosine;
  return pair.cosine - 2 * beyond_noise(pair.height_a) * beyond_noise(pair.height_b) / squared;
}

// What a pair with that reflected cosine is worth. Measured against the truth on two machined
// parts of 100 000 points with noise of 0.05, 0.1 and 0.3 %: bent pairs are right 20 to 40 times
// for each time they are wrong, whatever their cosine from 0.15 up; parallel ones 500 times or
// more, unless a step lies between them.
double Confidence(const Pair& pair) {
  const double cosine = ReflectedCosine(pair);
  const double size = std::abs(cosine);
  if (std::abs(pair.cosine) <= kEdgeSignVotes.parallel_cosine) {
    return std::copysign(kEdgeSignVotes.bent_worth * std::min(1.0, size / kEdgeSignVotes.undecided),
                         cosine);
  }
  if (size < kEdgeSignVotes.parallel_cosine) return 0;
  const double worth =
      kEdgeSignVotes.bent_worth + (1 - kEdgeSignVotes.bent_worth) *
                                      (std::min(size, 1.0) - kEdgeSignVotes.parallel_cosine) /
                                      (1 - kEdgeSignVotes.parallel_cosine);
  const double usual_step = 0.67 * pair.slack + 0.1 * pair.chord.norm();
  const double even =
      usual_step > 0 ? std::clamp(1.5 - StepHeight(pair) / usual_step, 0.0, 1.0) : 1.0;
  return std::copysign(worth * even, cosine);
}

double Relation(const OrientedCloud& cloud, const std::vector<float>& overlap, int a, int b) {
  const Pair pair = PairOf(cloud, a, b);
  if (!IsStep(pair, PairSpacing(cloud, a, b))) return Confidence(pair);
  // Sheets that face each other have the solid, or the air, between them.
  if (std::min(overlap[a], overlap[b]) > kEdgeSignVotes.all_around)
    return -kEdgeSignVotes.wall_worth * pair.cosine;
  // A stair, or a window set back in its wall, unless one of the points has the other sheet all
  // around.
  const bool beside = std::max(overlap[a], overlap[b]) <= kEdgeSignVotes.all_around;
  return std::copysign(kEdgeSignVotes.stair_worth, beside ? pair.cosine : ReflectedCosine(pair));
}

}  // namespace

absl::StatusOr<std::vector<float>> EdgeSignVotes(const NeighborGraph& graph,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context) {
  std::vector<float> overlap(static_cast<size_t>(graph.size()));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kSearchBlock, context, [&](int64_t i) {
    overlap[i] = Overlap(cloud, static_cast<int>(i), graph.neighbors(static_cast<int>(i)));
  }));
  std::vector<float> relations(graph.indices.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(graph.size(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t edge = begin * graph.k; edge < end * graph.k; ++edge) {
          relations[edge] = static_cast<float>(std::clamp(
              Relation(cloud, overlap, static_cast<int>(edge / graph.k), graph.indices[edge]), -1.0,
              1.0));
        }
      }));
  return relations;
}

double SignVote(const OrientedCloud& cloud, int a, int b) {
  return Confidence(PairOf(cloud, a, b));
}

}  // namespace rilievo
