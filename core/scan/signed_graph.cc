#include "core/scan/signed_graph.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "core/base/status_macros.h"
#include "core/scan/parity_sets.h"

namespace rilievo {
namespace {

// Links with a <= b, sorted, at most one a pair.
std::vector<SignedLink> Merged(std::vector<SignedLink> links) {
  for (SignedLink& link : links) {
    if (link.a > link.b) std::swap(link.a, link.b);
  }
  std::sort(links.begin(), links.end(), [](const SignedLink& x, const SignedLink& y) {
    return std::tie(x.a, x.b, x.weight) < std::tie(y.a, y.b, y.weight);
  });
  std::vector<SignedLink> merged;
  for (const SignedLink& link : links) {
    if (link.a == link.b) continue;
    if (!merged.empty() && merged.back().a == link.a && merged.back().b == link.b) {
      merged.back().weight += link.weight;
    } else {
      merged.push_back(link);
    }
  }
  return merged;
}

// The graph under contraction. Weights are relative to the current signs of the groups' heads.
class Contraction {
 public:
  Contraction(int nodes, const std::vector<SignedLink>& links) : links_of_(nodes), head_(nodes) {
    for (int i = 0; i < nodes; ++i) head_[i] = i;
    for (const SignedLink& link : links) {
      links_of_[link.a].push_back({link.b, link.weight});
      links_of_[link.b].push_back({link.a, link.weight});
      Push(link.a, link.b, link.weight);
    }
  }

  absl::Status Run(ParitySets* sets, const RunContext& context) {
    for (int64_t step = 0; !queue_.empty(); ++step) {
      if (step % 4096 == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const Candidate best = queue_.top();
      queue_.pop();
      const double* current = Weight(best.a, best.b);
      if (current == nullptr || *current != best.weight) continue;  // joined or changed since
      Join(best.a, best.b, best.weight, sets);
    }
    return absl::OkStatus();
  }

 private:
  using Neighbor = std::pair<int, double>;
  struct Candidate {
    double confidence;
    int a, b;
    double weight;
    bool operator<(const Candidate& other) const {
      return std::tie(confidence, other.a, other.b) < std::tie(other.confidence, a, b);
    }
  };

  void Push(int a, int b, double weight) {
    queue_.push({std::abs(weight), std::min(a, b), std::max(a, b), weight});
  }

  const double* Weight(int a, int b) const {
    if (links_of_[a].size() > links_of_[b].size()) std::swap(a, b);
    for (const Neighbor& neighbor : links_of_[a]) {
      if (neighbor.first == b) return &neighbor.second;
    }
    return nullptr;
  }

  // The head with fewer links goes into the other one.
  void Join(int keep, int gone, double weight, ParitySets* sets) {
    if (links_of_[keep].size() < links_of_[gone].size()) std::swap(keep, gone);
    const bool opposite = weight < 0;
    sets->Join(keep, gone, opposite ? 1 : 0);
    Erase(keep, gone);
    for (const auto& [other, other_weight] : links_of_[gone]) {
      if (other == keep) continue;
      Erase(other, gone);
      const double added = opposite ? -other_weight : other_weight;
      Push(keep, other, AddLink(keep, other, added));
      AddLink(other, keep, added);
    }
    links_of_[gone].clear();
    links_of_[gone].shrink_to_fit();
  }

  double AddLink(int from, int to, double weight) {
    for (Neighbor& neighbor : links_of_[from]) {
      if (neighbor.first == to) return neighbor.second += weight;
    }
    links_of_[from].push_back({to, weight});
    return weight;
  }

  void Erase(int from, int to) {
    std::vector<Neighbor>& list = links_of_[from];
    for (Neighbor& neighbor : list) {
      if (neighbor.first != to) continue;
      neighbor = list.back();
      list.pop_back();
      return;
    }
  }

  std::vector<std::vector<Neighbor>> links_of_;
  std::vector<int> head_;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, std::vector<SignedLink> links,
                                              const RunContext& context) {
  const std::vector<SignedLink> merged = Merged(std::move(links));
  ParitySets sets(nodes);
  Contraction contraction(nodes, merged);
  RILIEVO_RETURN_IF_ERROR(contraction.Run(&sets, context));
  SignedLabels labels;
  labels.component.resize(static_cast<size_t>(nodes));
  labels.sign.resize(static_cast<size_t>(nodes));
  std::vector<int> number(static_cast<size_t>(nodes), -1);
  for (int i = 0; i < nodes; ++i) {
    const int root = sets.Find(i);
    if (number[root] < 0) number[root] = labels.components++;
    labels.component[i] = number[root];
    labels.sign[i] = sets.parity(i) ? -1 : 1;
  }
  return labels;
}

}  // namespace rilievo
