#include "core/scan/orientation/orient_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/edge_sign_votes.h"
#include "core/scan/orientation/flipped_patches.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/outward_sign.h"
#include "core/scan/orientation/patch_dipoles.h"
#include "core/scan/orientation/settings.h"
#include "core/scan/orientation/signed_graph.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {
namespace {

std::vector<std::vector<int>> MembersOf(const std::vector<int>& group, int groups) {
  std::vector<std::vector<int>> members(static_cast<size_t>(groups));
  for (size_t i = 0; i < group.size(); ++i) members[group[i]].push_back(static_cast<int>(i));
  return members;
}

void Flip(const std::vector<int>& points, OrientedCloud* cloud) {
  for (const int i : points) cloud->normals.col(i) *= -1;
}

// Turns each group outward, and those inside an odd number of others, as the wall of a cavity is,
// inward; but for the group `sided` (-1: none), whose side is known.
absl::Status OrientGroups(const std::vector<std::vector<int>>& groups, int sided,
                          OrientedCloud* cloud, const RunContext& context) {
  for (size_t group = 0; group < groups.size(); ++group) {
    if (static_cast<int>(group) == sided) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (OutwardSign(*cloud, groups[group]) < 0) Flip(groups[group], cloud);
  }
  if (groups.size() < 2) return absl::OkStatus();
  std::vector<int> around(groups.size(), 0);
  for (size_t outer = 0; outer < groups.size(); ++outer) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const WindingField field(*cloud, groups[outer]);
    Eigen::AlignedBox3d box;
    for (const int i : groups[outer]) box.extend(cloud->points.col(i));
    for (size_t inner = 0; inner < groups.size(); ++inner) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      if (inner == outer || static_cast<int>(inner) == sided ||
          !box.contains(cloud->points.col(groups[inner].front())))
        continue;
      if (MeanWinding(field, *cloud, groups[inner]) > kOrientNormals.inside) ++around[inner];
    }
  }
  for (size_t group = 0; group < groups.size(); ++group) {
    if (around[group] % 2 == 1) Flip(groups[group], cloud);
  }
  return absl::OkStatus();
}

// One sign of each normal: turning it is all that happens to a normal here.
std::vector<uint8_t> SignsOf(const Eigen::Matrix3Xd& normals) {
  std::vector<uint8_t> signs(static_cast<size_t>(normals.cols()));
  for (int64_t i = 0; i < normals.cols(); ++i) signs[i] = std::signbit(normals(0, i));
  return signs;
}

// Which normals are no longer what they were. `signs`: theirs then.
std::vector<uint8_t> Turned(const std::vector<uint8_t>& signs, const Eigen::Matrix3Xd& normals) {
  std::vector<uint8_t> turned = SignsOf(normals);
  for (size_t i = 0; i < turned.size(); ++i) turned[i] ^= signs[i];
  return turned;
}

// +1 or -1 by patch: whether the normal of its first point is what it was. `turned`: see Turned.
std::vector<int> SignsOfPatches(const OrientationPatches& patches,
                                const std::vector<uint8_t>& turned) {
  std::vector<int> signs(static_cast<size_t>(patches.count));
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    signs[patches.patch[i]] = turned[i] == patches.parity[i] ? 1 : -1;
  }
  return signs;
}

// The links as the normals are now, > 0 where these agree with them. `turned`: normals that are no
// longer those that the links were found for.
std::vector<SignedLink> Agreements(const OrientationPatches& patches, std::vector<SignedLink> links,
                                   const std::vector<uint8_t>& turned) {
  const std::vector<int> signs = SignsOfPatches(patches, turned);
  for (SignedLink& link : links) link.weight *= signs[link.a] * signs[link.b];
  return links;
}

// 1 for each edge that wants its ends to be opposite: what is left of the relations, in a quarter
// of their memory.
std::vector<uint8_t> WantOpposite(const std::vector<float>& relations) {
  std::vector<uint8_t> opposite(relations.size());
  for (size_t edge = 0; edge < relations.size(); ++edge) opposite[edge] = relations[edge] < 0;
  return opposite;
}

// Share of edges that the present normals contradict.
absl::StatusOr<double> Disagreement(const NeighborGraph& graph,
                                    const std::vector<uint8_t>& want_opposite,
                                    const std::vector<uint8_t>& turned, const RunContext& context) {
  std::atomic<int64_t> disagree = 0;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(graph.size(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        int64_t here = 0;
        for (int64_t i = begin; i < end; ++i) {
          for (int64_t edge = i * graph.k; edge < (i + 1) * graph.k; ++edge) {
            const bool opposite = turned[i] != turned[graph.indices[edge]];
            here += opposite != (want_opposite[edge] != 0);
          }
        }
        disagree += here;
      }));
  return static_cast<double>(disagree.load()) /
         static_cast<double>(std::max<size_t>(1, want_opposite.size()));
}

// Patches with their relative signs.
struct LabelledPatches {
  OrientationPatches patches;
  std::vector<SignedLink> links;
  std::vector<double> sides;  // by patch, of its first point's sign; or empty
  SignedLabels labels;
};

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

// Points of patches whose side, where it is known, or else a good part of whose links, by weight,
// contradict the normals: who has seen a wall from both sides need not ask how thin it is.
// `turned`: see Agreements.
std::vector<uint8_t> Ambiguous(const LabelledPatches& labelled,
                               const std::vector<uint8_t>& turned) {
  const OrientationPatches& patches = labelled.patches;
  std::vector<double> against(static_cast<size_t>(patches.count), 0.0), total(against.size(), 0.0);
  for (const SignedLink& link : Agreements(patches, labelled.links, turned)) {
    for (const int patch : {link.a, link.b}) {
      against[patch] += std::max(0.0, -link.weight);
      total[patch] += std::abs(link.weight);
    }
  }
  const std::vector<int> signs = SignsOfPatches(patches, turned);
  const auto is_contested = [&](int patch) {
    const double side = labelled.sides.empty() ? 0 : signs[patch] * labelled.sides[patch];
    return side == 0 ? against[patch] > kOrientNormals.contested * total[patch] : side < 0;
  };
  std::vector<uint8_t> ambiguous;
  ambiguous.reserve(patches.patch.size());
  for (const int patch : patches.patch) ambiguous.push_back(is_contested(patch));
  return ambiguous;
}

// Keeps all by reference.
GroupRelation RelationOf(const OrientationPatches& patches, const OrientedCloud& cloud,
                         const RunContext& context) {
  if (IsLeftOut(Mechanism::kContestedGroups)) return {};
  return [dipoles = PatchDipoles(patches, cloud), &context](
             double balance, std::span<const SignedNode> a, std::span<const SignedNode> b) {
    return dipoles.Relation(balance, a, b, context);
  };
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
  RILIEVO_ASSIGN_OR_RETURN(result.labels,
                           LabelSignedGraph(result.patches.count, result.links, result.sides,
                                            RelationOf(result.patches, cloud, context), context));
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
    const int patch = alone.patches.patch[i];
    component[i] = alone.labels.component[patch];
    signs[i] = static_cast<int8_t>(
        (alone.labels.sign[patch] < 0) == (alone.patches.parity[i] != 0) ? 1 : -1);
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
    if (sides.votes[i] == 0) sides.votes[i] = kOrientNormals.normal_weight * normals[i];
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
  RILIEVO_ASSIGN_OR_RETURN(labelled.labels,
                           LabelSignedGraph(labelled.patches.count, labelled.links, labelled.sides,
                                            RelationOf(labelled.patches, cloud, context), context));
  return labelled;
}

// Turns the normals by the labels; then each component outward, unless sides have decided it.
absl::Status TurnByLabels(const LabelledPatches& labelled, OrientedCloud* cloud,
                          const RunContext& context) {
  const SignedLabels& labels = labelled.labels;
  std::vector<int> component(labelled.patches.patch.size());
  for (size_t i = 0; i < component.size(); ++i) {
    const int patch = labelled.patches.patch[i];
    component[i] = labels.component[patch];
    if (labelled.patches.parity[i] != (labels.sign[patch] < 0 ? 1 : 0)) {
      cloud->normals.col(static_cast<Eigen::Index>(i)) *= -1;
    }
  }
  return OrientGroups(MembersOf(component, labels.components), labels.sided, cloud, context);
}

}  // namespace

absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, PointSights sights,
                                                const SightOptions& options, OrientedCloud* cloud,
                                                const RunContext& context) {
  OrientationResult result;
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> relations, EdgeSignVotes(graph, *cloud, context));
  const std::vector<uint8_t> unoriented = SignsOf(cloud->normals);
  RILIEVO_ASSIGN_OR_RETURN(
      const LabelledPatches labelled,
      LabelBySights(graph, *cloud, relations, std::move(sights), options, context, &result));
  const std::vector<uint8_t> want_opposite = WantOpposite(relations);
  relations = std::vector<float>();
  RILIEVO_RETURN_IF_ERROR(TurnByLabels(labelled, cloud, context));
  std::vector<uint8_t> turned = Turned(unoriented, cloud->normals);
  if (labelled.sides.empty()) {
    const OrientationPatches& patches = labelled.patches;
    RILIEVO_RETURN_IF_ERROR(
        FlipInvertedPatches(patches, Agreements(patches, labelled.links, turned), cloud, context));
    turned = Turned(unoriented, cloud->normals);
  }
  if (!IsLeftOut(Mechanism::kAmbiguousNormals)) cloud->ambiguous = Ambiguous(labelled, turned);
  result.components = labelled.labels.components;
  RILIEVO_ASSIGN_OR_RETURN(result.disagreement,
                           Disagreement(graph, want_opposite, turned, context));
  return result;
}

}  // namespace rilievo
