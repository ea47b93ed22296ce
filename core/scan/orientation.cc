#include "core/scan/orientation.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/parity_sets.h"
#include "core/scan/signed_graph.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;
constexpr int kWeightLevels = 1024;

// What an edge says of its two normals.
struct Relation {
  float agreement;  // cosine after reflection: > 0 same sign, < 0 opposite; |.| near 1: sure
};

// The normal of one end, reflected at the bisector plane of the chord, is the normal of the other
// when both lie on a circular arc: exact on flat parts, at sharp edges and across thin walls
// (Xie et al. 2003; Koenig and Gumhold 2009).
double ReflectedCosine(const OrientedCloud& cloud, int a, int b) {
  constexpr double kNoiseDeviations = 3.0;
  const Eigen::Vector3d normal_a = cloud.normals.col(a);
  const Eigen::Vector3d normal_b = cloud.normals.col(b);
  const Eigen::Vector3d chord = cloud.points.col(b) - cloud.points.col(a);
  const double slack = kNoiseDeviations * std::max(cloud.noise[a], cloud.noise[b]);
  const auto beyond_noise = [slack](double height) {
    return std::copysign(std::max(0.0, std::abs(height) - slack), height);
  };
  const double bend = beyond_noise(chord.dot(normal_a)) * beyond_noise(chord.dot(normal_b));
  const double squared = chord.squaredNorm();
  return normal_a.dot(normal_b) - (squared > 0 ? 2 * bend / squared : 0.0);
}

// Small patches of points that surely belong together: joined along the spanning forest of
// ascending 1 - |cosine| as long as they stay small, so that one wrong edge spoils little.
ParitySets SurePatches(const NeighborGraph& graph, const std::vector<float>& cosines) {
  constexpr int kLargestPatch = 48;
  constexpr double kSureCosine = 0.7;
  std::vector<std::vector<int>> buckets(kWeightLevels + 1);
  for (size_t edge = 0; edge < cosines.size(); ++edge) {
    const double weight = 1 - std::abs(cosines[edge]);
    if (weight > 1 - kSureCosine) continue;
    buckets[static_cast<size_t>(std::max(weight, 0.0) * kWeightLevels)].push_back(
        static_cast<int>(edge));
  }
  ParitySets sets(graph.size());
  for (const std::vector<int>& bucket : buckets) {
    for (const int edge : bucket) {
      const int a = edge / graph.k, b = graph.indices[edge];
      if (sets.size(sets.Find(a)) + sets.size(sets.Find(b)) > kLargestPatch) continue;
      sets.Join(a, b, cosines[edge] < 0 ? 1 : 0);
    }
  }
  return sets;
}

// +1 or -1: the sign that turns the normals of `members` outward, voted by the extreme points in
// evenly spread directions.
double OutwardSign(const OrientedCloud& cloud, const std::vector<int>& members) {
  constexpr int kDirections = 64;
  double vote = 0;
  for (int d = 0; d < kDirections; ++d) {
    const double z = 1 - (2 * d + 1.0) / kDirections;
    const double angle = d * 2.399963229728653;  // golden angle
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d direction(r * std::cos(angle), r * std::sin(angle), z);
    int extreme = members.front();
    double furthest = direction.dot(cloud.points.col(extreme));
    for (const int i : members) {
      const double reach = direction.dot(cloud.points.col(i));
      if (reach > furthest) {
        furthest = reach;
        extreme = i;
      }
    }
    vote += direction.dot(cloud.normals.col(extreme));
  }
  return vote < 0 ? -1 : 1;
}

}  // namespace

absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, OrientedCloud* cloud,
                                                const RunContext& context) {
  std::vector<float> cosines(graph.indices.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(graph.size(), kBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          for (int64_t edge = i * graph.k; edge < (i + 1) * graph.k; ++edge) {
            cosines[edge] = static_cast<float>(
                ReflectedCosine(*cloud, static_cast<int>(i), graph.indices[edge]));
          }
        }
      }));
  ParitySets sets = SurePatches(graph, cosines);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  std::vector<int> patch(static_cast<size_t>(graph.size()), -1);
  int patches = 0;
  for (int i = 0; i < graph.size(); ++i) {
    const int root = sets.Find(i);
    if (patch[root] < 0) patch[root] = patches++;
    patch[i] = patch[root];
  }
  std::vector<SignedLink> links;
  for (size_t edge = 0; edge < cosines.size(); ++edge) {
    const int a = static_cast<int>(edge / graph.k);
    const int b = graph.indices[edge];
    if (patch[a] == patch[b]) continue;
    const double same = sets.parity(a) == sets.parity(b) ? 1 : -1;
    links.push_back({patch[a], patch[b], same * cosines[edge] * std::abs(cosines[edge])});
  }
  RILIEVO_ASSIGN_OR_RETURN(const SignedLabels labels,
                           LabelSignedGraph(patches, std::move(links), context));
  std::vector<std::vector<int>> members(static_cast<size_t>(labels.components));
  std::vector<uint8_t> flipped(static_cast<size_t>(graph.size()));
  for (int i = 0; i < graph.size(); ++i) {
    members[labels.component[patch[i]]].push_back(i);
    flipped[i] = sets.parity(i) ^ (labels.sign[patch[i]] < 0 ? 1 : 0);
    if (flipped[i]) cloud->normals.col(i) *= -1;
  }
  OrientationResult result;
  for (const std::vector<int>& component : members) {
    if (component.empty()) continue;
    ++result.components;
    if (OutwardSign(*cloud, component) > 0) continue;
    for (const int i : component) cloud->normals.col(i) *= -1;
  }
  int64_t disagree = 0;
  for (size_t edge = 0; edge < cosines.size(); ++edge) {
    const int a = static_cast<int>(edge / graph.k);
    const bool opposite = (flipped[a] ^ flipped[graph.indices[edge]]) != 0;
    if (opposite != (cosines[edge] < 0)) ++disagree;
  }
  result.disagreement = static_cast<double>(disagree) / std::max<size_t>(1, cosines.size());
  return result;
}

}  // namespace rilievo
