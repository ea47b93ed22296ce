#include "core/scan/orientation/signed_graph.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "core/base/status_macros.h"
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

  // Joins groups as long as links lead from one to another.
  absl::Status Run(const RunContext& context) {
    for (int64_t step = 0; !queue_.empty(); ++step) {
      if (step % 4096 == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const Candidate best = queue_.top();
      queue_.pop();
      const Bundle* current = Find(best.a, best.b);
      if (current == nullptr || current->net != best.net) continue;  // joined or changed since
      Join(best.a, best.b, *current);
    }
    return absl::OkStatus();
  }

  // The groups as they are, numbered by lowest node.
  SignedLabels TakeLabels() {
    SignedLabels labels;
    std::vector<int> number(links_of_.size(), -1);
    for (int i = 0; i < static_cast<int>(links_of_.size()); ++i) {
      const int root = sets_.Find(i);
      if (number[root] < 0) number[root] = labels.components++;
      labels.component.push_back(number[root]);
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

}  // namespace

absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, const std::vector<SignedLink>& links,
                                              const RunContext& context) {
  Contraction contraction(nodes, links);
  RILIEVO_RETURN_IF_ERROR(contraction.Run(context));
  return contraction.TakeLabels();
}

}  // namespace rilievo
