#include "core/scan/orientation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/scan/component_bridges.h"
#include "core/scan/normal_relations.h"
#include "core/scan/outward_sign.h"
#include "core/scan/parity_sets.h"
#include "core/scan/signed_graph.h"
#include "core/scan/winding_number.h"

namespace rilievo {
namespace {

// Points that surely belong together, and their signs within.
struct Patches {
  std::vector<int> patch;       // by point
  std::vector<uint8_t> parity;  // by point: 1 when opposite to the first of the patch
  int count = 0;
};

// Joined along the spanning forest of ascending 1 - |relation| (Hoppe et al. 1992, with a better
// weight) as long as patches stay small, so that one wrong edge spoils little.
Patches SurePatches(const NeighborGraph& graph, const std::vector<float>& relations) {
  constexpr int kLargestPatch = 48;
  constexpr double kSure = 0.7;
  constexpr int kLevels = 1024;
  std::vector<std::vector<int>> buckets(kLevels);
  for (size_t edge = 0; edge < relations.size(); ++edge) {
    const double doubt = (1 - std::abs(relations[edge])) / (1 - kSure);
    if (doubt >= 1) continue;
    buckets[static_cast<size_t>(std::max(doubt, 0.0) * kLevels)].push_back(static_cast<int>(edge));
  }
  ParitySets sets(graph.size());
  for (const std::vector<int>& bucket : buckets) {
    for (const int edge : bucket) {
      const int a = edge / graph.k, b = graph.indices[edge];
      if (sets.size(sets.Find(a)) + sets.size(sets.Find(b)) > kLargestPatch) continue;
      sets.Join(a, b, relations[edge] < 0 ? 1 : 0);
    }
  }
  Patches result;
  result.patch.resize(static_cast<size_t>(graph.size()));
  result.parity.resize(result.patch.size());
  std::vector<int> number(result.patch.size(), -1);
  for (int i = 0; i < graph.size(); ++i) {
    const int root = sets.Find(i);
    if (number[root] < 0) number[root] = result.count++;
    result.patch[i] = number[root];
    result.parity[i] = sets.parity(i);
  }
  return result;
}

std::vector<SignedLink> LinksBetween(const Patches& patches, const NeighborGraph& graph,
                                     const std::vector<float>& relations) {
  std::vector<SignedLink> links;
  for (size_t edge = 0; edge < relations.size(); ++edge) {
    const int a = static_cast<int>(edge / graph.k);
    const int b = graph.indices[edge];
    if (patches.patch[a] == patches.patch[b]) continue;
    const double vote = relations[edge];
    links.push_back({patches.patch[a], patches.patch[b],
                     patches.parity[a] == patches.parity[b] ? vote : -vote});
  }
  return links;
}

std::vector<std::vector<int>> MembersOf(const std::vector<int>& group, int groups) {
  std::vector<std::vector<int>> members(static_cast<size_t>(groups));
  for (size_t i = 0; i < group.size(); ++i) members[group[i]].push_back(static_cast<int>(i));
  return members;
}

void Flip(const std::vector<int>& points, OrientedCloud* cloud) {
  for (const int i : points) cloud->normals.col(i) *= -1;
}

// Each patch as one dipole, from the normals as they are.
std::vector<SurfacePatch> SurfacePatches(const OrientedCloud& cloud, const Patches& patches) {
  std::vector<SurfacePatch> surface(static_cast<size_t>(patches.count));
  std::vector<double> weight(surface.size(), 0.0);
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    const auto point = static_cast<int64_t>(i);
    SurfacePatch& patch = surface[patches.patch[i]];
    const double area = std::numbers::pi / 4 * cloud.spacing[i] * cloud.spacing[i];
    patch.center += area * cloud.points.col(point);
    patch.area += area * cloud.normals.col(point);
    weight[patches.patch[i]] += area;
  }
  for (size_t p = 0; p < surface.size(); ++p) {
    if (weight[p] > 0) surface[p].center /= weight[p];
    surface[p].blur = weight[p] / (2 * std::numbers::pi);
  }
  return surface;
}

// A sample of at most `most`, evenly along the list.
std::vector<int> Sample(const std::vector<int>& list, size_t most) {
  if (list.size() <= most) return list;
  std::vector<int> sample;
  for (size_t i = 0; i < most; ++i) sample.push_back(list[i * list.size() / most]);
  return sample;
}

// How far the winding number on the surface of a group is from one half, where it is on the
// surface of any solid (Xu et al. 2023), as things are and with the group flipped.
struct WindingMisfit {
  double as_is = 0, flipped = 0;  // mean squares
};

WindingMisfit MisfitOf(const std::vector<int>& group, const std::vector<SurfacePatch>& surface) {
  constexpr size_t kSamples = 48;
  std::vector<SurfacePatch> own;
  for (const int patch : group) own.push_back(surface[patch]);
  WindingMisfit misfit;
  const std::vector<int> sample = Sample(group, kSamples);
  for (const int patch : sample) {
    const double all = WindingNumber(surface, surface[patch].center);
    const double of_group = WindingNumber(own, surface[patch].center);
    const double as_is = all - 0.5, flipped = all - 2 * of_group - 0.5;
    misfit.as_is += as_is * as_is / static_cast<double>(sample.size());
    misfit.flipped += flipped * flipped / static_cast<double>(sample.size());
  }
  return misfit;
}

// The patches of a group that are as far off as the inside of a solid is from its surface, or more.
std::vector<int> MisfitPatches(const std::vector<int>& group,
                               const std::vector<SurfacePatch>& surface) {
  constexpr double kFarOff = 0.5;
  std::vector<int> misfits;
  for (const int patch : group) {
    const double winding = WindingNumber(surface, surface[patch].center);
    if (std::abs(winding - 0.5) > kFarOff) misfits.push_back(patch);
  }
  return misfits;
}

bool BetterFlipped(const std::vector<int>& group, const std::vector<SurfacePatch>& surface) {
  constexpr double kPoor = 0.1;
  constexpr double kBetter = 0.5;
  const WindingMisfit misfit = MisfitOf(group, surface);
  return misfit.as_is > kPoor && misfit.flipped < kBetter * misfit.as_is;
}

// Groups that a good part of their links contradict, as where a wall is thinner than the noise,
// are held against the winding number of the whole, and flipped where that is clearly better: the
// group, or those of its patches that fit worst.
absl::Status FlipContested(const SignedLabels& labels, const std::vector<SignedLink>& links,
                           const Patches& patches, OrientedCloud* cloud,
                           const RunContext& context) {
  constexpr double kAgainst = 0.08;
  constexpr int kFewestPatches = 3;
  constexpr int kMostGroups = 32;
  constexpr double kMostTerms = 4e6;  // of the sums over all patches for one group
  const std::vector<ContestedGroup> contested =
      ContestedGroups(labels, links, kAgainst, kFewestPatches, kMostGroups);
  if (contested.empty()) return absl::OkStatus();
  std::vector<SurfacePatch> surface = SurfacePatches(*cloud, patches);
  const std::vector<std::vector<int>> members = MembersOf(patches.patch, patches.count);
  for (const ContestedGroup& group : contested) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int> flip = group.nodes;
    if (!BetterFlipped(flip, surface)) {
      if (static_cast<double>(flip.size()) * patches.count > kMostTerms) continue;
      flip = MisfitPatches(flip, surface);
      if (static_cast<int>(flip.size()) < kFewestPatches || !BetterFlipped(flip, surface)) continue;
    }
    for (const int patch : flip) {
      surface[patch].area *= -1;
      Flip(members[patch], cloud);
    }
  }
  return absl::OkStatus();
}

// Turns each group outward, and those inside an odd number of others, as the wall of a cavity is,
// inward.
absl::Status OrientGroups(const std::vector<std::vector<int>>& groups, OrientedCloud* cloud,
                          const RunContext& context) {
  for (const std::vector<int>& group : groups) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (OutwardSign(*cloud, group) < 0) Flip(group, cloud);
  }
  constexpr size_t kDipoles = 4096;
  constexpr size_t kSamples = 16;
  constexpr double kInside = 0.75;
  if (groups.size() < 2) return absl::OkStatus();
  std::vector<int> around(groups.size(), 0);
  for (size_t outer = 0; outer < groups.size(); ++outer) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const std::vector<int> sources = Sample(groups[outer], kDipoles);
    const double share =
        static_cast<double>(groups[outer].size()) / static_cast<double>(sources.size());
    std::vector<SurfacePatch> surface;
    Eigen::AlignedBox3d box;
    for (const int i : sources) {
      const double area = share * std::numbers::pi / 4 * cloud->spacing[i] * cloud->spacing[i];
      surface.push_back(
          {cloud->points.col(i), area * cloud->normals.col(i), area / (2 * std::numbers::pi)});
      box.extend(cloud->points.col(i));
    }
    for (size_t inner = 0; inner < groups.size(); ++inner) {
      if (inner == outer || !box.contains(cloud->points.col(groups[inner].front()))) continue;
      double winding = 0;
      const std::vector<int> probes = Sample(groups[inner], kSamples);
      for (const int i : probes) {
        winding +=
            WindingNumber(surface, cloud->points.col(i)) / static_cast<double>(probes.size());
      }
      if (winding > kInside) ++around[inner];
    }
  }
  for (size_t group = 0; group < groups.size(); ++group) {
    if (around[group] % 2 == 1) Flip(groups[group], cloud);
  }
  return absl::OkStatus();
}

// Share of edges whose relation the present normals contradict.
double Disagreement(const NeighborGraph& graph, const std::vector<float>& relations,
                    const std::vector<uint8_t>& flipped) {
  int64_t disagree = 0;
  for (size_t edge = 0; edge < relations.size(); ++edge) {
    const bool opposite = flipped[edge / graph.k] != flipped[graph.indices[edge]];
    if (opposite != (relations[edge] < 0)) ++disagree;
  }
  return static_cast<double>(disagree) / static_cast<double>(std::max<size_t>(1, relations.size()));
}

}  // namespace

absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, OrientedCloud* cloud,
                                                const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> relations,
                           NormalRelations(graph, *cloud, context));
  const Eigen::Matrix3Xd unoriented = cloud->normals;
  const Patches patches = SurePatches(graph, relations);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  const std::vector<SignedLink> links = LinksBetween(patches, graph, relations);
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
  RILIEVO_RETURN_IF_ERROR(OrientGroups(MembersOf(component, bridged.components), cloud, context));
  RILIEVO_RETURN_IF_ERROR(FlipContested(labels, links, patches, cloud, context));

  OrientationResult result;
  result.components = labels.components;
  std::vector<uint8_t> flipped(static_cast<size_t>(graph.size()));
  for (int i = 0; i < graph.size(); ++i) {
    flipped[i] = unoriented.col(i).dot(cloud->normals.col(i)) < 0;
  }
  result.disagreement = Disagreement(graph, relations, flipped);
  return result;
}

}  // namespace rilievo
