// Signs for the nodes of a graph whose links say 'same' or 'opposite', not always rightly.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace rilievo {

struct SignedLink {
  int a = 0, b = 0;
  double weight = 0;  // > 0: same sign, < 0: opposite; the more the surer
};

// A node of a group, with its sign relative to the group's: +1 or -1.
struct SignedNode {
  int node;
  int sign;
};

// Whether two groups of nodes whose links contradict each other have the same sign, > 0, or
// opposite ones, < 0; none where they had better stay apart. `balance`: of the links between them.
// CANCELLED when stopped.
using GroupRelation = std::function<absl::StatusOr<std::optional<double>>(
    double balance, std::span<const SignedNode> a, std::span<const SignedNode> b)>;

struct SignedLabels {
  std::vector<int> component;  // by node: a number in [0, components), by lowest node
  std::vector<int> sign;       // by node: +1 or -1, relative within the component
  int components = 0;
  // The component of the nodes whose sign is absolute, since sides have decided it; -1: none.
  int sided = -1;
};

// Joins the two groups with the largest |sum of weights between them| until no links are left;
// weights add up as groups grow, so a few wrong links are outvoted by those beside them, where a
// spanning tree would hang a whole sheet on one of them (greedy additive edge contraction;
// Keuper et al. 2015, Bailoni et al. 2022). Where the balance of the links between two groups is
// not sure, their relation decides; groups that stay apart are asked again when a twentieth more
// weight leads from the one to the other. `sides`: by node, > 0 for those that are to be +1, < 0
// for those that are to be -1, the more the surer, on the scale of the links; or empty. A side
// counts as a link to one more node, whose sign is +1.
absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, const std::vector<SignedLink>& links,
                                              const std::vector<double>& sides,
                                              const GroupRelation& relation,
                                              const RunContext& context);

}  // namespace rilievo
