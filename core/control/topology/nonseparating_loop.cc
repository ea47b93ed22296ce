#include "core/control/topology/nonseparating_loop.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "core/geometry/disjoint_sets.h"

namespace rilievo {

namespace {

void Provide(int size, std::vector<int>* scratch) {
  if (scratch->empty()) scratch->resize(static_cast<size_t>(size), 0);
}

}  // namespace

NonseparatingLoopFinder::NonseparatingLoopFinder(const MeshTopology& topology,
                                                 const Eigen::Matrix3Xd& vertices)
    : topology_(topology), vertices_(vertices) {
  VertexTables tables;
  tables.edge_begin.assign(topology.vertex_count + 1, 0);
  tables.face_begin.assign(topology.vertex_count + 1, 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    for (int k = 0; k < 2; ++k) ++tables.edge_begin[topology.edge_vertices(k, e) + 1];
  }
  for (int f = 0; f < topology.face_count(); ++f) ++tables.face_begin[topology.faces(0, f) + 1];
  for (std::vector<int>* begin : {&tables.edge_begin, &tables.face_begin}) {
    std::partial_sum(begin->begin(), begin->end(), begin->begin());
  }
  tables.edges.resize(tables.edge_begin.back());
  std::vector<int> next(tables.edge_begin.begin(), tables.edge_begin.end() - 1);
  for (int e = 0; e < topology.edge_count(); ++e) {
    for (int k = 0; k < 2; ++k) {
      tables.edges[next[topology.edge_vertices(k, e)]++] = e;
    }
  }
  tables.faces.resize(tables.face_begin.back());
  next.assign(tables.face_begin.begin(), tables.face_begin.end() - 1);
  for (int f = 0; f < topology.face_count(); ++f) tables.faces[next[topology.faces(0, f)]++] = f;
  tables_ = std::make_shared<const VertexTables>(std::move(tables));
}

std::vector<int> NonseparatingLoopFinder::LoopAround(int root, double radius) {
  Disc(root, radius);
  const std::vector<LoopEdge> edges = LoopEdges();
  return edges.empty() ? std::vector<int>() : TreeLoop(std::ranges::min(edges).edge);
}

std::vector<int> NonseparatingLoopFinder::MarkLoops(int root, std::vector<uint8_t>* marks) {
  disc_vertices_.reserve(topology_.vertex_count);
  disc_faces_.reserve(topology_.face_count());
  disc_edges_.reserve(topology_.edge_count());
  std::vector<int> component = Disc(root, std::numeric_limits<double>::infinity());
  for (const LoopEdge& closing : LoopEdges()) {
    for (const int v : TreeLoop(closing.edge)) (*marks)[v] = 1;
  }
  return component;
}

double NonseparatingLoopFinder::Length(const std::vector<int>& loop) const {
  double length = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    length += (vertices_.col(loop[i]) - vertices_.col(loop[(i + 1) % loop.size()])).norm();
  }
  return length;
}

// Dijkstra over edges up to `radius`.
const std::vector<int>& NonseparatingLoopFinder::Disc(int root, double radius) {
  Provide(topology_.vertex_count, &vertex_stamp_);
  Provide(topology_.vertex_count, &parent_edge_);
  if (distance_.empty()) distance_.resize(static_cast<size_t>(topology_.vertex_count));
  ++stamp_;
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  disc_vertices_.clear();
  distance_[root] = 0;
  parent_edge_[root] = -1;
  vertex_stamp_[root] = stamp_;
  front.push({0.0, root});
  while (!front.empty()) {
    const auto [distance, v] = front.top();
    front.pop();
    if (distance > distance_[v]) continue;
    disc_vertices_.push_back(v);
    for (const int e : EdgesAt(v)) {
      const int w = topology_.edge_vertices(0, e) + topology_.edge_vertices(1, e) - v;
      const double reached = distance + (vertices_.col(v) - vertices_.col(w)).norm();
      if (reached > radius) continue;
      if (vertex_stamp_[w] == stamp_ && distance_[w] <= reached) continue;
      vertex_stamp_[w] = stamp_;
      distance_[w] = reached;
      parent_edge_[w] = e;
      front.push({reached, w});
    }
  }
  return disc_vertices_;
}

// Faces whose three corners were reached, and their edges.
void NonseparatingLoopFinder::CollectFaces() {
  Provide(topology_.face_count(), &face_slot_);
  disc_faces_.clear();
  for (const int v : disc_vertices_) {
    for (const int f : FacesOf(v)) {
      if (vertex_stamp_[topology_.faces(1, f)] != stamp_) continue;
      if (vertex_stamp_[topology_.faces(2, f)] != stamp_) continue;
      face_slot_[f] = static_cast<int>(disc_faces_.size());
      disc_faces_.push_back(f);
    }
  }
  CollectEdges();
}

void NonseparatingLoopFinder::CollectEdges() {
  Provide(topology_.vertex_count, &counted_stamp_);
  disc_edges_.clear();
  border_.clear();
  used_vertices_ = 0;
  const auto use = [&](int v) {
    used_vertices_ += counted_stamp_[v] != stamp_;
    counted_stamp_[v] = stamp_;
  };
  for (const int v : disc_vertices_) {
    for (const int e : EdgesAt(v)) {
      const int w = topology_.edge_vertices(0, e) + topology_.edge_vertices(1, e) - v;
      if (w < v || vertex_stamp_[w] != stamp_) continue;
      int inside = 0;
      for (int side = 0; side < 2; ++side) {
        const int f = topology_.edge_faces(side, e);
        inside += f >= 0 && IsInDisc(f);
      }
      if (inside == 0) continue;
      use(v);
      use(w);
      disc_edges_.push_back(e);
      if (inside == 1) border_.push_back(e);
    }
  }
}

// Boundary edges of the disc that share a vertex belong to one boundary loop, so the disc counts as
// pinched there: it then has fewer handles than it may have, never more.
int NonseparatingLoopFinder::CapBoundary() {
  if (border_.empty()) return 0;
  Provide(topology_.edge_count(), &boundary_set_);
  DisjointSets joined(border_.size());
  std::vector<std::pair<int, int>> ends;
  for (size_t i = 0; i < border_.size(); ++i) {
    for (int k = 0; k < 2; ++k) {
      ends.push_back({topology_.edge_vertices(k, border_[i]), static_cast<int>(i)});
    }
  }
  std::sort(ends.begin(), ends.end());
  for (size_t i = 1; i < ends.size(); ++i) {
    if (ends[i].first == ends[i - 1].first) joined.Unite(ends[i].second, ends[i - 1].second);
  }
  std::vector<int> number(border_.size(), -1);
  int loops = 0;
  for (uint32_t i = 0; i < border_.size(); ++i) {
    int& set = number[joined.Find(i)];
    if (set < 0) set = loops++;
    boundary_set_[border_[i]] = set;
  }
  return loops;
}

std::vector<NonseparatingLoopFinder::LoopEdge> NonseparatingLoopFinder::LoopEdges() {
  CollectFaces();
  if (disc_faces_.empty()) return {};
  const int boundary_loops = CapBoundary();
  const int euler =
      used_vertices_ - static_cast<int>(disc_edges_.size()) + static_cast<int>(disc_faces_.size());
  if (2 - boundary_loops - euler < 2) return {};
  // The cotree: faces and caps joined across edges off the shortest-path tree, farthest edges
  // first, so that what stays are the edges that close short loops.
  std::vector<LoopEdge> candidates, closing;
  candidates.reserve(disc_edges_.size());
  for (const int e : disc_edges_) {
    const int a = topology_.edge_vertices(0, e), b = topology_.edge_vertices(1, e);
    if (parent_edge_[a] == e || parent_edge_[b] == e) continue;
    const double length =
        distance_[a] + distance_[b] + (vertices_.col(a) - vertices_.col(b)).norm();
    candidates.push_back({static_cast<float>(length), e});
  }
  std::sort(candidates.begin(), candidates.end(), std::greater<>());
  const int face_count = static_cast<int>(disc_faces_.size());
  DisjointSets joined(static_cast<size_t>(face_count + boundary_loops));
  for (const LoopEdge& candidate : candidates) {
    const int e = candidate.edge;
    int dual[2], found = 0;
    for (int side = 0; side < 2; ++side) {
      const int f = topology_.edge_faces(side, e);
      if (f >= 0 && IsInDisc(f)) dual[found++] = face_slot_[f];
    }
    if (found == 1) dual[1] = face_count + boundary_set_[e];
    if (joined.Find(dual[0]) != joined.Find(dual[1])) {
      joined.Unite(dual[0], dual[1]);
    } else if (found == 2) {
      closing.push_back(candidate);
    }
  }
  return closing;
}

// Both ways to the root, without the part they share.
std::vector<int> NonseparatingLoopFinder::TreeLoop(int closing_edge) const {
  std::vector<int> way[2];
  for (int k = 0; k < 2; ++k) {
    int v = topology_.edge_vertices(k, closing_edge);
    way[k].push_back(v);
    while (parent_edge_[v] >= 0) {
      v = topology_.edge_vertices(0, parent_edge_[v]) +
          topology_.edge_vertices(1, parent_edge_[v]) - v;
      way[k].push_back(v);
    }
  }
  while (way[0].size() > 1 && way[1].size() > 1 &&
         way[0][way[0].size() - 2] == way[1][way[1].size() - 2]) {
    way[0].pop_back();
    way[1].pop_back();
  }
  std::vector<int> loop(way[0]);
  loop.insert(loop.end(), way[1].rbegin() + 1, way[1].rend());
  return loop;
}

}  // namespace rilievo
