// Signs for the nodes of a graph whose links say 'same' or 'opposite', not always rightly.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace rilievo {

struct SignedLink {
  int a = 0, b = 0;
  double weight = 0;  // > 0: same sign, < 0: opposite; the more the surer
};

// Two groups that became one. A group is named by its node, or by nodes + its place among the
// merges.
struct SignedMerge {
  int first = 0, second = 0;
  double net = 0;    // |sum of the weights between the two|
  double total = 0;  // sum of their magnitudes
};

struct SignedLabels {
  std::vector<int> component;  // by node: a number in [0, components), by lowest node
  std::vector<int> sign;       // by node: +1 or -1, relative within the component
  int components = 0;
  std::vector<SignedMerge> merges;  // in order: each group comes after its parts
};

// Joins the two groups with the largest |sum of weights between them| until no links are left;
// weights add up as groups grow, so a few wrong links are outvoted by those beside them, where a
// spanning tree would hang a whole sheet on one of them (greedy additive edge contraction;
// Keuper et al. 2015, Bailoni et al. 2022).
absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, const std::vector<SignedLink>& links,
                                              const RunContext& context);

// A group of the merges that some of its links to the rest contradict.
struct ContestedGroup {
  std::vector<int> nodes;
  double against = 0;  // share of the weight between the group and the rest, in [0, 1]
};

// Groups of at least `fewest` nodes and at most half of their component, with more than `share` of
// the weight to the rest against their present sign. Of groups within each other only those that
// are clearly smaller than the one around them; the largest first, at most `most`.
std::vector<ContestedGroup> ContestedGroups(const SignedLabels& labels,
                                            const std::vector<SignedLink>& links, double share,
                                            int fewest, int most);

}  // namespace rilievo
