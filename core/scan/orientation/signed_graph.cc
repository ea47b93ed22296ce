#include "core/scan/orientation/signed_graph.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/kernighan_lin.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// Links with a < b, sorted, so that sums do not depend on the order they came in.
std::vector<SignedLink> Sorted(std::vector<SignedLink> links) {
  for (SignedLink& link : links) {
    if (link.a > link.b) std::swap(link.a, link.b);
  }
  std::sort(links.begin(), links.end(), [](const SignedLink& x, const SignedLink& y) {
    return std::tie(x.a, x.b, x.weight) < std::tie(y.a, y.b, y.weight);
  });
  return links;
}

struct Labels {
  std::vector<int> group;  // by node
  std::vector<int> sign;   // by node: +1 or -1, relative within the group
  int groups = 0;
};

// The graph under contraction. Weights are relative to the present signs of the groups' heads.
class Contraction {
 public:
  Contraction(int nodes, const std::vector<SignedLink>& links) : links_of_(nodes), sets_(nodes) {
    for (const SignedLink& link : Sorted(links)) {
      if (link.a == link.b) continue;
      const Bundle bundle{link.b, link.weight};
      std::vector<Bundle>& list = links_of_[link.a];
      if (!list.empty() && list.back().to == link.b) {
        list.back().net += bundle.net;
      } else {
        list.push_back(bundle);
      }
    }
    // The other direction of each, once the sums are complete.
    std::vector<std::vector<Bundle>> forward = links_of_;
    for (int a = 0; a < nodes; ++a) {
      for (const Bundle& bundle : forward[a]) {
        links_of_[bundle.to].push_back({a, bundle.net});
        Push(a, bundle.to, bundle.net);
      }
    }
  }

  // Joins groups as long as none gets more than `largest` nodes.
  absl::Status Run(int largest, const RunContext& context) {
    std::vector<Candidate> too_large;
    for (int64_t step = 0; !queue_.empty(); ++step) {
      if (step % 4096 == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const Candidate best = queue_.top();
      queue_.pop();
      const Bundle* current = Find(best.a, best.b);
      if (current == nullptr || current->net != best.net) continue;  // joined or changed since
      if (sets_.size(sets_.Find(best.a)) + sets_.size(sets_.Find(best.b)) > largest) {
        too_large.push_back(best);
      } else {
        Join(best.a, best.b, *current);
      }
    }
    for (const Candidate& candidate : too_large) queue_.push(candidate);
    return absl::OkStatus();
  }

  // The groups as they are, numbered by lowest node.
  Labels TakeLabels() {
    Labels labels;
    std::vector<int> number(links_of_.size(), -1);
    for (int i = 0; i < static_cast<int>(links_of_.size()); ++i) {
      const int root = sets_.Find(i);
      if (number[root] < 0) number[root] = labels.groups++;
      labels.group.push_back(number[root]);
      labels.sign.push_back(sets_.parity(i) != 0 ? -1 : 1);
    }
    return labels;
  }

 private:
  // All links to one other head.
  struct Bundle {
    int to;
    double net;
  };
  struct Candidate {
    double confidence;
    int a, b;
    double net;
    bool operator<(const Candidate& other) const {
      return std::tie(confidence, other.a, other.b) < std::tie(other.confidence, a, b);
    }
  };

  void Push(int a, int b, double net) {
    queue_.push({std::abs(net), std::min(a, b), std::max(a, b), net});
  }

  const Bundle* Find(int a, int b) const {
    if (links_of_[a].size() > links_of_[b].size()) std::swap(a, b);
    for (const Bundle& bundle : links_of_[a]) {
      if (bundle.to == b) return &bundle;
    }
    return nullptr;
  }

  // The head with fewer links goes into the other one.
  void Join(int keep, int gone, const Bundle between) {
    if (links_of_[keep].size() < links_of_[gone].size()) std::swap(keep, gone);
    const bool opposite = between.net < 0;
    sets_.Join(keep, gone, opposite ? 1 : 0);
    Erase(keep, gone);
    for (const Bundle& bundle : links_of_[gone]) {
      if (bundle.to == keep) continue;
      Erase(bundle.to, gone);
      const double net = opposite ? -bundle.net : bundle.net;
      Push(keep, bundle.to, AddTo(keep, {bundle.to, net}));
      AddTo(bundle.to, {keep, net});
    }
    links_of_[gone].clear();
    links_of_[gone].shrink_to_fit();
  }

  // The net weight then.
  double AddTo(int from, const Bundle& added) {
    for (Bundle& bundle : links_of_[from]) {
      if (bundle.to != added.to) continue;
      bundle.net += added.net;
      return bundle.net;
    }
    links_of_[from].push_back(added);
    return added.net;
  }

  void Erase(int from, int to) {
    std::vector<Bundle>& list = links_of_[from];
    for (Bundle& bundle : list) {
      if (bundle.to != to) continue;
      bundle = list.back();
      list.pop_back();
      return;
    }
  }

  std::vector<std::vector<Bundle>> links_of_;  // by head
  SignedUnionFind sets_;
  std::priority_queue<Candidate> queue_;
};

// The sums of the weights between groups of nodes under the present signs: symmetric, diagonal 0.
Eigen::MatrixXd WeightsBetween(const std::vector<int>& group_of, int groups,
                               const std::vector<SignedLink>& links,
                               const std::vector<int>& signs) {
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(groups, groups);
  for (const SignedLink& link : links) {
    const int a = group_of[link.a], b = group_of[link.b];
    if (a == b) continue;
    const double net = link.weight * signs[link.a] * signs[link.b];
    weights(a, b) += net;
    weights(b, a) += net;
  }
  return weights;
}

// Which of the groups to turn, searched for among all of them at once.
absl::Status TurnGroups(const std::vector<int>& group_of, int groups,
                        const std::vector<SignedLink>& links, const RunContext& context,
                        std::vector<int>* signs) {
  constexpr int kMostGroups = 1500;  // the weights between them are held in a square
  constexpr int kMostPasses = 8;
  constexpr double kRounding = 1e-9;
  if (groups > kMostGroups) return absl::OkStatus();
  const Eigen::MatrixXd weights = WeightsBetween(group_of, groups, links, *signs);
  Eigen::VectorXd turns = Eigen::VectorXd::Ones(groups);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (KernighanLinPass(weights, &turns) <= kRounding * weights.cwiseAbs().sum()) break;
  }
  for (size_t i = 0; i < signs->size(); ++i) {
    if (turns[group_of[i]] < 0) (*signs)[i] = -(*signs)[i];
  }
  return absl::OkStatus();
}

// Joined in the order of their confidence.
absl::StatusOr<Labels> SurestMerges(int nodes, const std::vector<SignedLink>& links,
                                    const RunContext& context) {
  Contraction contraction(nodes, links);
  RILIEVO_RETURN_IF_ERROR(contraction.Run(nodes, context));
  return contraction.TakeLabels();
}

// Grown in groups of equal size first, then searched for the best signs of these: right in the
// large, where the surest merges in turn may hang a wall on the wrong side for good.
absl::StatusOr<std::vector<int>> SignsOfEvenGroups(int nodes, const std::vector<SignedLink>& links,
                                                   const RunContext& context) {
  constexpr int kGroups = 100;
  constexpr int kFewestNodes = 4;  // of the largest group
  Contraction contraction(nodes, links);
  RILIEVO_RETURN_IF_ERROR(contraction.Run(std::max(kFewestNodes, nodes / kGroups), context));
  const Labels even = contraction.TakeLabels();
  RILIEVO_RETURN_IF_ERROR(contraction.Run(nodes, context));
  std::vector<int> signs = contraction.TakeLabels().sign;
  RILIEVO_RETURN_IF_ERROR(TurnGroups(even.group, even.groups, links, context, &signs));
  return signs;
}

double Agreement(const std::vector<SignedLink>& links, const std::vector<int>& signs) {
  double sum = 0;
  for (const SignedLink& link : links) sum += link.weight * signs[link.a] * signs[link.b];
  return sum;
}

// The better of the two, and of every part in which they differ the better sign.
absl::StatusOr<std::vector<int>> Fuse(const std::vector<int>& first, const std::vector<int>& second,
                                      const std::vector<SignedLink>& links,
                                      const RunContext& context) {
  SignedUnionFind parts(static_cast<int>(first.size()));
  for (const SignedLink& link : links) {
    const bool same_a = first[link.a] == second[link.a], same_b = first[link.b] == second[link.b];
    if (same_a == same_b) parts.Join(link.a, link.b, 0);
  }
  std::vector<int> number(first.size(), -1), part_of(first.size());
  int count = 0;
  for (size_t i = 0; i < first.size(); ++i) {
    int& name = number[parts.Find(static_cast<int>(i))];
    if (name < 0) name = count++;
    part_of[i] = name;
  }
  std::vector<int> signs = Agreement(links, first) >= Agreement(links, second) ? first : second;
  RILIEVO_RETURN_IF_ERROR(TurnGroups(part_of, count, links, context, &signs));
  return signs;
}

}  // namespace

absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, const std::vector<SignedLink>& links,
                                              const RunContext& context) {
  absl::StatusOr<Labels> surest;
  absl::StatusOr<std::vector<int>> even;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(2, 1, context, [&](int64_t begin, int64_t end) {
    for (int64_t way = begin; way < end; ++way) {
      if (way == 0) {
        surest = SurestMerges(nodes, links, context);
      } else {
        even = SignsOfEvenGroups(nodes, links, context);
      }
    }
  }));
  RILIEVO_RETURN_IF_ERROR(surest.status());
  RILIEVO_RETURN_IF_ERROR(even.status());
  if (IsLeftOut(Mechanism::kEvenGroups)) even = surest->sign;
  RILIEVO_ASSIGN_OR_RETURN(std::vector<int> signs, Fuse(surest->sign, *even, links, context));
  return SignedLabels{std::move(surest->group), std::move(signs), surest->groups};
}

}  // namespace rilievo
