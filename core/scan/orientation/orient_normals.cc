#include "core/scan/orientation/orient_normals.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/edge_sign_votes.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/outward_sign.h"
#include "core/scan/orientation/signed_graph.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {
namespace {

// By component how many others it lies inside of: those whose winding number there is one.
std::vector<int> Enclosures(const OrientedCloud& cloud, const std::vector<int>& component,
                            int count) {
  constexpr int kProbes = 16;
  std::vector<int> size(static_cast<size_t>(count), 0), seen(size), probes(size);
  for (const int c : component) ++size[c];
  std::vector<double> winding(size.size(), 0.0);
  const WindingField field(cloud);
  for (size_t i = 0; i < component.size(); ++i) {
    const int c = component[i];
    if (seen[c]++ % std::max(1, size[c] / kProbes) != 0) continue;
    winding[c] += field.At(cloud.points.col(static_cast<Eigen::Index>(i)));
    ++probes[c];
  }
  std::vector<int> enclosures;
  for (int c = 0; c < count; ++c) {
    const double of_others = winding[c] / probes[c] - 0.5;  // one half on its own surface
    enclosures.push_back(static_cast<int>(std::max(0L, std::lround(of_others))));
  }
  return enclosures;
}

// Turns each component outward, and those inside an odd number of others, as the wall of a cavity
// is, inward; but for `sided` (-1: none), whose side is known.
void TurnOutward(const std::vector<int>& component, int count, int sided, OrientedCloud* cloud) {
  const auto turn = [&](const auto& is_wrong) {
    for (size_t i = 0; i < component.size(); ++i) {
      if (component[i] == sided || !is_wrong(component[i])) continue;
      cloud->normals.col(static_cast<Eigen::Index>(i)) *= -1;
    }
  };
  const std::vector<int> outward = OutwardSigns(*cloud, component, count);
  turn([&](int c) { return outward[c] < 0; });
  if (count < 2) return;
  const std::vector<int> enclosures = Enclosures(*cloud, component, count);
  turn([&](int c) { return enclosures[c] % 2 == 1; });
}

// Patches with their relative signs.
struct LabelledPatches {
  OrientationPatches patches;
  std::vector<SignedLink> links;
  std::vector<double> sides;  // by patch, of its first point's sign; or empty
  SignedLabels labels;

  // +1 or -1: what the normal of a point is to be turned by, within its component.
  int SignOf(size_t point) const {
    const int sign = labels.sign[patches.patch[point]];
    return patches.parity[point] != 0 ? -sign : sign;
  }
};

// Share of the votes of edges that the labels contradict.
absl::StatusOr<double> Disagreement(const NeighborGraph& graph, const std::vector<float>& relations,
                                    const LabelledPatches& labelled, const RunContext& context) {
  std::atomic<int64_t> disagree = 0;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(graph.size(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        int64_t here = 0;
        for (int64_t i = begin; i < end; ++i) {
          for (int64_t edge = i * graph.k; edge < (i + 1) * graph.k; ++edge) {
            const auto j = static_cast<size_t>(graph.indices[edge]);
            const bool opposite = labelled.SignOf(static_cast<size_t>(i)) != labelled.SignOf(j);
            here += opposite != (relations[edge] < 0);
          }
        }
        disagree += here;
      }));
  return static_cast<double>(disagree.load()) /
         static_cast<double>(std::max<size_t>(1, relations.size()));
}

// What a given normal weighs against a station: it may be wrong, and half as much is outvoted by
// the neighbours of a single point.
constexpr float kNormalWeight = 0.5F;

// A station weighs as much as all neighbours of its point together.
std::vector<double> SidesOf(const OrientationPatches& patches, const SideVotes& votes, int k) {
  std::vector<double> sides;
  if (votes.empty()) return sides;
  sides.assign(static_cast<size_t>(patches.count), 0.0);
  for (size_t i = 0; i < votes.size(); ++i) {
    sides[patches.patch[i]] += (patches.parity[i] != 0 ? -k : k) * double{votes[i]};
  }
  return sides;
}

// Points of patches a good part of whose links and sides, by weight, contradict the labels.
std::vector<uint8_t> Ambiguous(const LabelledPatches& labelled) {
  constexpr double kContested = 0.2;
  const OrientationPatches& patches = labelled.patches;
  const std::vector<int>& sign = labelled.labels.sign;
  std::vector<double> against(static_cast<size_t>(patches.count), 0.0), total(against.size(), 0.0);
  const auto count = [&](int patch, double agreement) {
    against[patch] += std::max(0.0, -agreement);
    total[patch] += std::abs(agreement);
  };
  for (const SignedLink& link : labelled.links) {
    const double agreement = sign[link.a] * sign[link.b] * link.weight;
    count(link.a, agreement);
    count(link.b, agreement);
  }
  for (size_t patch = 0; patch < labelled.sides.size(); ++patch) {
    count(static_cast<int>(patch), sign[patch] * labelled.sides[patch]);
  }
  std::vector<uint8_t> ambiguous;
  ambiguous.reserve(patches.patch.size());
  for (const int patch : patches.patch) {
    ambiguous.push_back(against[patch] > kContested * total[patch]);
  }
  return ambiguous;
}

// `votes`: see SideVotes; or empty.
absl::StatusOr<LabelledPatches> LabelPatches(const NeighborGraph& graph, const OrientedCloud& cloud,
                                             const std::vector<float>& relations,
                                             const SideVotes& votes, const RunContext& context) {
  LabelledPatches result;
  RILIEVO_ASSIGN_OR_RETURN(result.patches, SurePatches(graph, relations, context));
  RILIEVO_ASSIGN_OR_RETURN(result.links,
                           LinksBetween(result.patches, graph, relations, cloud, context));
  result.sides = SidesOf(result.patches, votes, graph.k);
  RILIEVO_ASSIGN_OR_RETURN(
      result.labels, LabelSignedGraph(result.patches.count, result.links, result.sides, context));
  return result;
}

// How consistent votes are with the signs that the neighbours alone give. `weights`: see
// ConsistencyOf.
double ConsistencyWith(const LabelledPatches& alone, const SideVotes& votes,
                       const std::vector<float>& weights) {
  if (votes.empty()) return 0;
  std::vector<int> component(votes.size());
  std::vector<int8_t> signs(votes.size());
  for (size_t i = 0; i < votes.size(); ++i) {
    component[i] = alone.labels.component[alone.patches.patch[i]];
    signs[i] = static_cast<int8_t>(alone.SignOf(i));
  }
  return ConsistencyOf(votes, weights, component, signs);
}

// What the scanner knows, as far as it is wanted and believed.
struct BelievedSides {
  SideVotes votes;  // none when nothing is
  // By the neighbours alone, where belief took that.
  std::optional<LabelledPatches> alone;
};

absl::StatusOr<BelievedSides> BelieveSides(const NeighborGraph& graph, const OrientedCloud& cloud,
                                           const std::vector<float>& relations, PointSights sights,
                                           const SightOptions& options, const RunContext& context,
                                           OrientationResult* result) {
  BelievedSides sides;
  SideVotes stations, normals;
  if (options.stations != SightRule::kIgnore) {
    stations = StationVotes(sights, cloud, &result->stations);
  }
  if (options.normals != SightRule::kIgnore) {
    normals = NormalVotes(sights, cloud, &result->normals);
  }
  const auto is_doubted = [](SightRule rule, const SideVotes& votes) {
    return rule == SightRule::kAuto && !votes.empty();
  };
  std::vector<float> weights;
  if (is_doubted(options.stations, stations)) weights = StationWeights(sights, cloud);
  sights = PointSights();
  if (is_doubted(options.stations, stations) || is_doubted(options.normals, normals)) {
    RILIEVO_ASSIGN_OR_RETURN(sides.alone, LabelPatches(graph, cloud, relations, {}, context));
    result->stations.consistency = ConsistencyWith(*sides.alone, stations, weights);
    result->normals.consistency = ConsistencyWith(*sides.alone, normals, {});
  }
  result->stations.used = IsBelieved(options.stations, result->stations);
  result->normals.used = IsBelieved(options.normals, result->normals);
  if (result->stations.used) sides.votes = std::move(stations);
  if (!result->normals.used) return sides;
  sides.votes.resize(normals.size(), 0);
  for (size_t i = 0; i < normals.size(); ++i) {
    if (sides.votes[i] == 0) sides.votes[i] = kNormalWeight * normals[i];
  }
  return sides;
}

// Labels the patches by the neighbours, and by the sights where these are believed.
absl::StatusOr<LabelledPatches> LabelBySights(const NeighborGraph& graph,
                                              const OrientedCloud& cloud,
                                              const std::vector<float>& relations,
                                              PointSights sights, const SightOptions& options,
                                              const RunContext& context,
                                              OrientationResult* result) {
  RILIEVO_ASSIGN_OR_RETURN(
      BelievedSides believed,
      BelieveSides(graph, cloud, relations, std::move(sights), options, context, result));
  if (!believed.alone) return LabelPatches(graph, cloud, relations, believed.votes, context);
  LabelledPatches labelled = *std::move(believed.alone);
  if (believed.votes.empty()) return labelled;
  labelled.sides = SidesOf(labelled.patches, believed.votes, graph.k);
  RILIEVO_ASSIGN_OR_RETURN(labelled.labels, LabelSignedGraph(labelled.patches.count, labelled.links,
                                                             labelled.sides, context));
  return labelled;
}

// Turns the normals by the labels; then each component outward, unless sides have decided it.
void TurnByLabels(const LabelledPatches& labelled, OrientedCloud* cloud) {
  const SignedLabels& labels = labelled.labels;
  std::vector<int> component(labelled.patches.patch.size());
  for (size_t i = 0; i < component.size(); ++i) {
    component[i] = labels.component[labelled.patches.patch[i]];
    cloud->normals.col(static_cast<Eigen::Index>(i)) *= labelled.SignOf(i);
  }
  TurnOutward(component, labels.components, labels.sided, cloud);
}

}  // namespace

absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, PointSights sights,
                                                const SightOptions& options, OrientedCloud* cloud,
                                                const RunContext& context) {
  OrientationResult result;
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> relations, EdgeSignVotes(graph, *cloud, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const LabelledPatches labelled,
      LabelBySights(graph, *cloud, relations, std::move(sights), options, context, &result));
  RILIEVO_ASSIGN_OR_RETURN(result.disagreement, Disagreement(graph, relations, labelled, context));
  relations = std::vector<float>();
  TurnByLabels(labelled, cloud);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (!IsLeftOut(Mechanism::kAmbiguousNormals)) cloud->ambiguous = Ambiguous(labelled);
  result.components = labelled.labels.components;
  return result;
}

}  // namespace rilievo
