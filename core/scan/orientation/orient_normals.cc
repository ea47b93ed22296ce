#include "core/scan/orientation/orient_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/component_bridges.h"
#include "core/scan/orientation/edge_sign_votes.h"
#include "core/scan/orientation/flipped_patches.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/outward_sign.h"
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

// A sample of at most `most`, evenly along the list.
std::vector<int> Sample(const std::vector<int>& list, size_t most) {
  if (list.size() <= most) return list;
  std::vector<int> sample;
  for (size_t i = 0; i < most; ++i) sample.push_back(list[i * list.size() / most]);
  return sample;
}

// Points of patches a good part of whose links, by weight, contradict the normals.
std::vector<uint8_t> Ambiguous(const OrientationPatches& patches,
                               const std::vector<SignedLink>& agreements) {
  constexpr double kContested = 0.2;
  std::vector<double> against(static_cast<size_t>(patches.count), 0.0), total(against.size(), 0.0);
  for (const SignedLink& link : agreements) {
    for (const int patch : {link.a, link.b}) {
      against[patch] += std::max(0.0, -link.weight);
      total[patch] += std::abs(link.weight);
    }
  }
  std::vector<uint8_t> ambiguous;
  ambiguous.reserve(patches.patch.size());
  for (const int patch : patches.patch) {
    ambiguous.push_back(against[patch] > kContested * total[patch]);
  }
  return ambiguous;
}

// Turns each group outward, and those inside an odd number of others, as the wall of a cavity is,
// inward.
absl::Status OrientGroups(const std::vector<std::vector<int>>& groups, OrientedCloud* cloud,
                          const RunContext& context) {
  for (const std::vector<int>& group : groups) {
    const int sign = OutwardSign(*cloud, group, context);
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (sign < 0) Flip(group, cloud);
  }
  constexpr size_t kSamples = 16;
  constexpr double kInside = 0.75;
  if (groups.size() < 2) return absl::OkStatus();
  std::vector<int> around(groups.size(), 0);
  for (size_t outer = 0; outer < groups.size(); ++outer) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const WindingField field(*cloud, groups[outer]);
    Eigen::AlignedBox3d box;
    for (const int i : groups[outer]) box.extend(cloud->points.col(i));
    for (size_t inner = 0; inner < groups.size(); ++inner) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      if (inner == outer || !box.contains(cloud->points.col(groups[inner].front()))) continue;
      double winding = 0;
      const std::vector<int> probes = Sample(groups[inner], kSamples);
      for (const int i : probes) {
        winding += field.At(cloud->points.col(i)) / static_cast<double>(probes.size());
      }
      if (winding > kInside) ++around[inner];
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

// The links as the normals are now, > 0 where these agree with them. `turned`: normals that are no
// longer those that the links were found for.
std::vector<SignedLink> Agreements(const OrientationPatches& patches, std::vector<SignedLink> links,
                                   const std::vector<uint8_t>& turned) {
  std::vector<int> signs(static_cast<size_t>(patches.count));
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    signs[patches.patch[i]] = turned[i] == patches.parity[i] ? 1 : -1;
  }
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
  constexpr int64_t kPointsPerTask = 8192;
  std::atomic<int64_t> disagree = 0;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(graph.size(), kPointsPerTask, context, [&](int64_t begin, int64_t end) {
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

}  // namespace

absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, OrientedCloud* cloud,
                                                const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> relations, EdgeSignVotes(graph, *cloud, context));
  const std::vector<uint8_t> unoriented = SignsOf(cloud->normals);
  RILIEVO_ASSIGN_OR_RETURN(const OrientationPatches patches,
                           SurePatches(graph, relations, context));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<SignedLink> links,
                           LinksBetween(patches, graph, relations, *cloud, context));
  const std::vector<uint8_t> want_opposite = WantOpposite(relations);
  relations = std::vector<float>();
  RILIEVO_ASSIGN_OR_RETURN(const SignedLabels labels,
                           LabelSignedGraph(patches.count, links, context));
  std::vector<int> component(static_cast<size_t>(graph.size()));
  for (int i = 0; i < graph.size(); ++i) {
    const int patch = patches.patch[i];
    component[i] = labels.component[patch];
    if (patches.parity[i] != (labels.sign[patch] < 0 ? 1 : 0)) cloud->normals.col(i) *= -1;
  }

  RILIEVO_ASSIGN_OR_RETURN(const std::vector<SignedLink> bridges,
                           BridgeComponents(*cloud, component, labels.components, context));
  RILIEVO_ASSIGN_OR_RETURN(const SignedLabels bridged,
                           LabelSignedGraph(labels.components, bridges, context));
  for (int i = 0; i < graph.size(); ++i) {
    if (bridged.sign[component[i]] < 0) cloud->normals.col(i) *= -1;
    component[i] = bridged.component[component[i]];
  }
  const std::vector<std::vector<int>> groups = MembersOf(component, bridged.components);
  RILIEVO_RETURN_IF_ERROR(OrientGroups(groups, cloud, context));
  std::vector<uint8_t> turned = Turned(unoriented, cloud->normals);
  RILIEVO_RETURN_IF_ERROR(
      FlipInvertedPatches(patches, Agreements(patches, links, turned), cloud, context));
  turned = Turned(unoriented, cloud->normals);
  if (!IsLeftOut(Mechanism::kAmbiguousNormals)) {
    cloud->ambiguous = Ambiguous(patches, Agreements(patches, std::move(links), turned));
  }

  OrientationResult result;
  result.components = labels.components;
  RILIEVO_ASSIGN_OR_RETURN(result.disagreement,
                           Disagreement(graph, want_opposite, turned, context));
  return result;
}

}  // namespace rilievo
