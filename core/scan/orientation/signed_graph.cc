#include "core/scan/orientation/signed_graph.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/settings.h"
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

// The graph under contraction. Weights are relative to the present signs of the groups' heads.
class Contraction {
 public:
  Contraction(int nodes, const std::vector<SignedLink>& links, const std::vector<double>& sides,
              const GroupRelation& relation)
      : side_node_(nodes),
        relation_(relation),
        links_of_(nodes),
        side_of_(sides),
        sets_(nodes + 1),
        next_(nodes) {
    side_of_.resize(static_cast<size_t>(nodes), 0.0);
    std::iota(next_.begin(), next_.end(), 0);
    for (int a = 0; a < nodes; ++a) PushSide(a);
    for (const SignedLink& link : Sorted(links)) {
      if (link.a == link.b) continue;
      const Bundle bundle{link.b, link.weight, std::abs(link.weight)};
      std::vector<Bundle>& list = links_of_[link.a];
      if (!list.empty() && list.back().to == link.b) {
        list.back().net += bundle.net;
        list.back().total += bundle.total;
      } else {
        list.push_back(bundle);
      }
    }
    // The other direction of each, once the sums are complete.
    std::vector<std::vector<Bundle>> forward = links_of_;
    for (int a = 0; a < nodes; ++a) {
      for (const Bundle& bundle : forward[a]) {
        links_of_[bundle.to].push_back({a, bundle.net, bundle.total});
        Push(a, bundle.to, bundle.net);
      }
    }
  }

  // Joins groups as long as links lead from one to another.
  absl::Status Run(const RunContext& context) {
    for (int64_t step = 0; !queue_.empty(); ++step) {
      if (step % 4096 == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const Candidate best = queue_.top();
      queue_.pop();
      if (best.b == side_node_) {
        if (side_of_[best.a] == best.net) TakeSide(best.a);
        continue;
      }
      const Bundle* current = Find(best.a, best.b);
      if (current == nullptr || current->net != best.net) continue;  // joined or changed since
      RILIEVO_RETURN_IF_ERROR(Join(best.a, best.b, *current));
    }
    return absl::OkStatus();
  }

  // The groups as they are, numbered by lowest node.
  SignedLabels TakeLabels() {
    SignedLabels labels;
    std::vector<int> number(links_of_.size() + 1, -1);
    const int sided_root = sets_.Find(side_node_);
    const uint8_t sided_parity = sets_.parity(side_node_);
    for (int i = 0; i < side_node_; ++i) {
      const int root = sets_.Find(i);
      if (number[root] < 0) number[root] = labels.components++;
      labels.component.push_back(number[root]);
      const uint8_t origin = root == sided_root ? sided_parity : 0;
      labels.sign.push_back(sets_.parity(i) != origin ? -1 : 1);
    }
    labels.sided = number[sided_root];
    return labels;
  }

 private:
  // All links to one other head.
  struct Bundle {
    int to;
    double net, total;  // sums of the weights and of their sizes
    double asked = 0;   // the latter when these groups were last found to stay apart
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

  void PushSide(int a) {
    if (side_of_[a] != 0) queue_.push({std::abs(side_of_[a]), a, side_node_, side_of_[a]});
  }

  // The head gets the sign of its side; what it says of others is then said of their sides.
  void TakeSide(int head) {
    const bool opposite = side_of_[head] < 0;
    side_of_[head] = 0;
    sets_.Join(side_node_, head, opposite ? 1 : 0);
    for (const Bundle& bundle : links_of_[head]) {
      Erase(bundle.to, head);
      side_of_[bundle.to] += opposite ? -bundle.net : bundle.net;
      PushSide(bundle.to);
    }
    FreeMemoryOf(&links_of_[head]);
  }

  const Bundle* Find(int a, int b) const {
    if (links_of_[a].size() > links_of_[b].size()) std::swap(a, b);
    for (const Bundle& bundle : links_of_[a]) {
      if (bundle.to == b) return &bundle;
    }
    return nullptr;
  }

  void StayApart(int a, int b) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      for (Bundle& bundle : links_of_[from]) {
        if (bundle.to == to) bundle.asked = bundle.total;
      }
    }
  }

  // Its nodes, with their signs relative to the head's.
  std::vector<SignedNode> MembersOf(int head) {
    std::vector<SignedNode> members;
    sets_.Find(head);
    const uint8_t origin = sets_.parity(head);
    int node = head;
    do {
      sets_.Find(node);
      members.push_back({node, sets_.parity(node) != origin ? -1 : 1});
      node = next_[node];
    } while (node != head);
    return members;
  }

  // None where they stay apart.
  absl::StatusOr<std::optional<bool>> AreOpposite(int a, int b, const Bundle& between) {
    const double balance = between.total > 0 ? between.net / between.total : 0;
    if (!relation_ || std::abs(balance) > kSignedGraph.sure_balance) return balance < 0;
    if (between.asked > 0 && between.total < kSignedGraph.growth * between.asked)
      return std::nullopt;
    RILIEVO_ASSIGN_OR_RETURN(const std::optional<double> relation,
                             relation_(balance, MembersOf(a), MembersOf(b)));
    if (relation) return *relation < 0;
    StayApart(a, b);
    return std::nullopt;
  }

  // The head with fewer links goes into the other one.
  absl::Status Join(int keep, int gone, const Bundle between) {
    if (links_of_[keep].size() < links_of_[gone].size()) std::swap(keep, gone);
    RILIEVO_ASSIGN_OR_RETURN(const std::optional<bool> are, AreOpposite(keep, gone, between));
    if (!are) return absl::OkStatus();
    const bool opposite = *are;
    sets_.Join(keep, gone, opposite ? 1 : 0);
    std::swap(next_[keep], next_[gone]);
    Erase(keep, gone);
    if (side_of_[gone] != 0) {
      side_of_[keep] += opposite ? -side_of_[gone] : side_of_[gone];
      side_of_[gone] = 0;
      PushSide(keep);
    }
    for (const Bundle& bundle : links_of_[gone]) {
      if (bundle.to == keep) continue;
      Erase(bundle.to, gone);
      const double net = opposite ? -bundle.net : bundle.net;
      Push(keep, bundle.to, AddTo(keep, {bundle.to, net, bundle.total, bundle.asked}));
      AddTo(bundle.to, {keep, net, bundle.total, bundle.asked});
    }
    links_of_[gone].clear();
    links_of_[gone].shrink_to_fit();
    return absl::OkStatus();
  }

  // The net weight then.
  double AddTo(int from, const Bundle& added) {
    for (Bundle& bundle : links_of_[from]) {
      if (bundle.to != added.to) continue;
      bundle.net += added.net;
      bundle.total += added.total;
      bundle.asked = std::max(bundle.asked, added.asked);
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

  const int side_node_;  // behind the others
  const GroupRelation& relation_;
  std::vector<std::vector<Bundle>> links_of_;  // by head
  std::vector<double> side_of_;                // by head; 0 once it is taken
  SignedUnionFind sets_;
  std::vector<int> next_;  // by node: another one of its group, all of them in a ring
  std::priority_queue<Candidate> queue_;
};

}  // namespace

absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, const std::vector<SignedLink>& links,
                                              const std::vector<double>& sides,
                                              const GroupRelation& relation,
                                              const RunContext& context) {
  Contraction contraction(nodes, links, sides, relation);
  RILIEVO_RETURN_IF_ERROR(contraction.Run(context));
  return contraction.TakeLabels();
}

}  // namespace rilievo
