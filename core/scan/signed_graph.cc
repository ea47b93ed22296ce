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
  Contraction(int nodes, const std::vector<SignedLink>& links)
      : links_of_(nodes), group_(nodes), sets_(nodes) {
    for (int i = 0; i < nodes; ++i) group_[i] = i;
    for (const SignedLink& link : Sorted(links)) {
      if (link.a == link.b) continue;
      const Bundle bundle{link.b, link.weight, std::abs(link.weight)};
      std::vector<Bundle>& list = links_of_[link.a];
      if (!list.empty() && list.back().to == link.b) {
        list.back().Add(bundle);
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

  ParitySets& sets() { return sets_; }
  std::vector<SignedMerge> TakeMerges() { return std::move(merges_); }

 private:
  // All links to one other head.
  struct Bundle {
    int to;
    double net, total;
    void Add(const Bundle& other) {
      net += other.net;
      total += other.total;
    }
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
    merges_.push_back({group_[keep], group_[gone], std::abs(between.net), between.total});
    group_[keep] = static_cast<int>(links_of_.size() + merges_.size()) - 1;
    Erase(keep, gone);
    for (const Bundle& bundle : links_of_[gone]) {
      if (bundle.to == keep) continue;
      Erase(bundle.to, gone);
      const double net = opposite ? -bundle.net : bundle.net;
      Push(keep, bundle.to, AddTo(keep, {bundle.to, net, bundle.total}));
      AddTo(bundle.to, {keep, net, bundle.total});
    }
    links_of_[gone].clear();
    links_of_[gone].shrink_to_fit();
  }

  // The net weight then.
  double AddTo(int from, const Bundle& added) {
    for (Bundle& bundle : links_of_[from]) {
      if (bundle.to != added.to) continue;
      bundle.Add(added);
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
  std::vector<int> group_;                     // by head: its name among the merges
  ParitySets sets_;
  std::vector<SignedMerge> merges_;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

absl::StatusOr<SignedLabels> LabelSignedGraph(int nodes, const std::vector<SignedLink>& links,
                                              const RunContext& context) {
  Contraction contraction(nodes, links);
  RILIEVO_RETURN_IF_ERROR(contraction.Run(context));
  SignedLabels labels;
  labels.component.resize(static_cast<size_t>(nodes));
  labels.sign.resize(static_cast<size_t>(nodes));
  labels.merges = contraction.TakeMerges();
  std::vector<int> number(static_cast<size_t>(nodes), -1);
  for (int i = 0; i < nodes; ++i) {
    const int root = contraction.sets().Find(i);
    if (number[root] < 0) number[root] = labels.components++;
    labels.component[i] = number[root];
    labels.sign[i] = contraction.sets().parity(i) ? -1 : 1;
  }
  return labels;
}

namespace {

// What a group's links to the rest weigh. What lies within is what its merges joined, so it is
// that of the nodes less twice that of the merges.
struct GroupWeight {
  double net = 0, total = 0;
  int size = 1;
  double against() const { return total > 0 ? (total - net) / (2 * total) : 0; }
};

// By name of the group.
std::vector<GroupWeight> WeighGroups(const SignedLabels& labels,
                                     const std::vector<SignedLink>& links) {
  const size_t nodes = labels.sign.size();
  std::vector<GroupWeight> groups(nodes + labels.merges.size());
  for (const SignedLink& link : links) {
    if (link.a == link.b) continue;
    const double net = link.weight * labels.sign[link.a] * labels.sign[link.b];
    for (const int node : {link.a, link.b}) {
      groups[node].net += net;
      groups[node].total += std::abs(link.weight);
    }
  }
  for (size_t m = 0; m < labels.merges.size(); ++m) {
    const SignedMerge& merge = labels.merges[m];
    const GroupWeight& first = groups[merge.first];
    const GroupWeight& second = groups[merge.second];
    groups[nodes + m] = {first.net + second.net - 2 * merge.net,
                         first.total + second.total - 2 * merge.total, first.size + second.size};
  }
  return groups;
}

std::vector<int> NodesOf(const SignedLabels& labels, int name) {
  const int nodes = static_cast<int>(labels.sign.size());
  std::vector<int> found, open = {name};
  while (!open.empty()) {
    const int at = open.back();
    open.pop_back();
    if (at < nodes) {
      found.push_back(at);
      continue;
    }
    open.push_back(labels.merges[at - nodes].first);
    open.push_back(labels.merges[at - nodes].second);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::vector<ContestedGroup> ContestedGroups(const SignedLabels& labels,
                                            const std::vector<SignedLink>& links, double share,
                                            int fewest, int most) {
  constexpr double kClearlySmaller = 0.75;
  const int nodes = static_cast<int>(labels.sign.size());
  const std::vector<GroupWeight> groups = WeighGroups(labels, links);
  // Downwards, so that each group knows the size of the smallest chosen one around it; at the top
  // that bound admits half of the component.
  std::vector<double> bound(groups.size(), 0.0);
  std::vector<int> chosen;
  for (int name = static_cast<int>(groups.size()) - 1; name >= nodes; --name) {
    const GroupWeight& group = groups[name];
    if (bound[name] == 0) bound[name] = group.size / 2.0 / kClearlySmaller;
    if (group.size >= fewest && group.against() > share &&
        group.size <= kClearlySmaller * bound[name]) {
      chosen.push_back(name);
      bound[name] = group.size;
    }
    const SignedMerge& merge = labels.merges[name - nodes];
    for (const int part : {merge.first, merge.second}) bound[part] = bound[name];
  }
  std::stable_sort(chosen.begin(), chosen.end(),
                   [&](int a, int b) { return groups[a].size > groups[b].size; });
  if (chosen.size() > static_cast<size_t>(most)) chosen.resize(static_cast<size_t>(most));
  std::vector<ContestedGroup> result;
  for (const int name : chosen) result.push_back({NodesOf(labels, name), groups[name].against()});
  return result;
}

}  // namespace rilievo
