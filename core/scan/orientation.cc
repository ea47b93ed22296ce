#include "core/scan/orientation.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/scan/normal_relations.h"
#include "core/scan/outward_sign.h"
#include "core/scan/parity_sets.h"
#include "core/scan/signed_graph.h"

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

}  // namespace

absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, OrientedCloud* cloud,
                                                const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> relations,
                           NormalRelations(graph, *cloud, context));
  const Patches patches = SurePatches(graph, relations);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  RILIEVO_ASSIGN_OR_RETURN(
      const SignedLabels labels,
      LabelSignedGraph(patches.count, LinksBetween(patches, graph, relations), context));

  std::vector<std::vector<int>> members(static_cast<size_t>(labels.components));
  std::vector<uint8_t> flipped(static_cast<size_t>(graph.size()));
  for (int i = 0; i < graph.size(); ++i) {
    const int patch = patches.patch[i];
    members[labels.component[patch]].push_back(i);
    flipped[i] = patches.parity[i] ^ (labels.sign[patch] < 0 ? 1 : 0);
    if (flipped[i]) cloud->normals.col(i) *= -1;
  }
  OrientationResult result;
  result.components = labels.components;
  for (const std::vector<int>& component : members) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (OutwardSign(*cloud, component) > 0) continue;
    for (const int i : component) cloud->normals.col(i) *= -1;
  }
  int64_t disagree = 0;
  for (size_t edge = 0; edge < relations.size(); ++edge) {
    const bool opposite = flipped[edge / graph.k] != flipped[graph.indices[edge]];
    if (opposite != (relations[edge] < 0)) ++disagree;
  }
  result.disagreement =
      static_cast<double>(disagree) / static_cast<double>(std::max<size_t>(1, relations.size()));
  return result;
}

}  // namespace rilievo
