#include "core/control/quads/pair_triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/base/key_heap.h"
#include "core/control/quads/settings.h"

namespace rilievo {
namespace {

using Side = std::array<int, 2>;

// The corner of a triangle that is not on its side from `from` to `to`.
int ApexOf(const Polygon& triangle, int from) { return triangle.At(triangle.SideFrom(from) + 2); }

// The quad of the triangles on both sides of an edge.
std::array<int, 4> QuadAcross(const PolygonSet& polygons, const Side& side) {
  const auto [from, to] = side;
  return {from, ApexOf(polygons[polygons.WithSide(to, from)], to), to,
          ApexOf(polygons[polygons.WithSide(from, to)], from)};
}

// None where no two triangles lie there.
std::optional<float> PairCost(const PolygonSet& polygons, const Side& side) {
  for (const int p : {polygons.WithSide(side[0], side[1]), polygons.WithSide(side[1], side[0])}) {
    if (p < 0 || polygons[p].size != 3) return std::nullopt;
  }
  if (polygons.IsCrease(side[0], side[1])) return std::nullopt;
  const std::array<int, 4> quad = QuadAcross(polygons, side);
  const double squareness = SquarenessOf(polygons, quad);
  if (squareness < kPairTriangles.least_squareness) return std::nullopt;
  double change = polygons.ValenceChange(side, {});
  for (size_t i = 0; i < 4; ++i)
    change += IsFlatCorner(polygons, quad, i) ? kPairTriangles.flat_corner : 0;
  // A KeyHeap takes no key below 0.
  return static_cast<float>(std::exp(kPairTriangles.valence_weight * change - squareness));
}

int PartnersOf(const PolygonSet& polygons, int triangle) {
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    const Side side = {polygons[triangle].At(i), polygons[triangle].At(i + 1)};
    if (PairCost(polygons, side)) ++count;
  }
  return count;
}

// A triangle that is passed over with one partner left may be left alone.
bool IsUrgent(const PolygonSet& polygons, const Side& side) {
  return PartnersOf(polygons, polygons.WithSide(side[0], side[1])) == 1 ||
         PartnersOf(polygons, polygons.WithSide(side[1], side[0])) == 1;
}

class GreedyPairing {
 public:
  explicit GreedyPairing(PolygonSet* polygons) : polygons_(*polygons) {}

  void Run() {
    for (int p = 0; p < polygons_.size(); ++p) {
      for (int i = 0; i < 3; ++i) {
        const Side side = {polygons_[p].At(i), polygons_[p].At(i + 1)};
        if (side[0] < side[1]) Push(side);
      }
    }
    while (!urgent_.empty() || !others_.empty()) {
      KeyHeap& heap = urgent_.empty() ? others_ : urgent_;
      const uint64_t key = heap.Pop();
      const int number = KeyHeap::IndexOf(key);
      const Side side = sides_[static_cast<size_t>(number)];
      const std::optional<float> cost = PairCost(polygons_, side);
      if (!cost) continue;
      if (*cost == KeyHeap::ValueOf(key) && &HeapFor(side) == &heap) {
        Pair(side);
      } else {  // valences or partners have changed since
        HeapFor(side).Push(KeyHeap::KeyOf(*cost, number));
      }
    }
  }

 private:
  void Push(const Side& side) {
    const std::optional<float> cost = PairCost(polygons_, side);
    if (!cost) return;
    HeapFor(side).Push(KeyHeap::KeyOf(*cost, static_cast<int>(sides_.size())));
    sides_.push_back(side);
  }

  KeyHeap& HeapFor(const Side& side) { return IsUrgent(polygons_, side) ? urgent_ : others_; }

  void Pair(const Side& side) {
    const std::array<int, 4> quad = QuadAcross(polygons_, side);
    const int first = polygons_.WithSide(side[0], side[1]);
    polygons_.Remove(polygons_.WithSide(side[1], side[0]));
    polygons_.Remove(first);
    polygons_.Add(quad);
    // The triangles beside it have a partner less.
    for (size_t i = 0; i < 4; ++i) {
      const int beside = polygons_.WithSide(quad[(i + 1) % 4], quad[i]);
      if (beside < 0 || polygons_[beside].size != 3) continue;
      for (int k = 0; k < 3; ++k) Push({polygons_[beside].At(k), polygons_[beside].At(k + 1)});
    }
  }

  PolygonSet& polygons_;
  std::vector<Side> sides_;
  KeyHeap urgent_, others_;
};

// The sides to cross, each of the polygon before it; the last one may lie on the boundary.
std::optional<std::vector<Side>> FindWay(const PolygonSet& polygons, int triangle,
                                         const std::set<Side>& blocked) {
  struct Reached {
    double steps = 0;
    int from = -1;  // polygon before
    Side side{};    // of it
  };
  std::unordered_map<int, Reached> reached = {{triangle, {}}};
  std::set<std::pair<double, int>> open = {{0.0, triangle}};
  int end = -1;
  double end_steps = 0;
  std::optional<Side> last;
  while (!open.empty()) {
    const auto [steps, here] = *open.begin();
    open.erase(open.begin());
    if (end >= 0 && steps >= end_steps) break;
    if (here != triangle && polygons[here].size == 3) {
      end = here;
      last.reset();
      break;
    }
    for (int i = 0; i < polygons[here].size; ++i) {
      const Side side = {polygons[here].At(i), polygons[here].At(i + 1)};
      if (blocked.contains(side)) continue;
      const int next = polygons.WithSide(side[1], side[0]);
      if (next < 0) {
        if (end >= 0 && steps + kPairTriangles.boundary_steps >= end_steps) continue;
        end = here;
        end_steps = steps + kPairTriangles.boundary_steps;
        last = side;
        continue;
      }
      const double there =
          steps + (polygons.IsCrease(side[0], side[1]) ? kPairTriangles.crease_steps : 1.0);
      const auto [entry, is_new] = reached.try_emplace(next, Reached{there, here, side});
      if (!is_new) {
        if (entry->second.steps <= there) continue;
        open.erase({entry->second.steps, next});
        entry->second = {there, here, side};
      }
      open.insert({there, next});
    }
  }
  if (end < 0) return std::nullopt;
  std::vector<Side> way;
  if (last) way.push_back(*last);
  for (int at = end; at != triangle; at = reached.at(at).from) way.push_back(reached.at(at).side);
  std::reverse(way.begin(), way.end());
  return way;
}

// Cuts a pentagon into a quad and the triangle with side `exit`, whichever of two is squarer.
bool CutPentagon(const std::array<int, 5>& corners, const Side& exit, PolygonSet* polygons) {
  size_t i = 0;
  while (corners[i] != exit[0]) ++i;
  const auto at = [&](size_t k) { return corners[(i + k) % 5]; };
  const std::array<std::array<int, 3>, 2> triangles = {
      {{at(0), at(1), at(2)}, {at(4), at(0), at(1)}}};
  const std::array<std::array<int, 4>, 2> quads = {
      {{at(0), at(2), at(3), at(4)}, {at(1), at(2), at(3), at(4)}}};
  const std::array<bool, 2> possible = {!polygons->HasEdge(at(0), at(2)),
                                        !polygons->HasEdge(at(1), at(4))};
  if (!possible[0] && !possible[1]) return false;
  size_t best = possible[0] ? 0 : 1;
  if (possible[0] && possible[1] &&
      SquarenessOf(*polygons, quads[1]) > SquarenessOf(*polygons, quads[0])) {
    best = 1;
  }
  polygons->Add(triangles[best]);
  polygons->Add(quads[best]);
  return true;
}

struct Stepped {
  bool as_planned = true;
  int triangle = -1;  // that is left; -1: none
};

// The triangle crosses a crease, whose halves it leaves in a quad; the polygon beyond gets a
// corner.
Stepped CrossCrease(const Side& side, const Side* exit, PolygonSet* polygons) {
  const auto [a, b] = side;
  const int here = polygons->WithSide(a, b), next = polygons->WithSide(b, a);
  const int apex = ApexOf((*polygons)[here], a);
  const int middle = polygons->SplitEdge(a, b);
  polygons->Remove(here);
  if (next < 0) {
    polygons->Add(std::array{a, middle, b, apex});
    return {};
  }
  const Polygon other = (*polygons)[next];
  const int i = other.SideFrom(b);
  const int y = other.At(i + 2), z = other.At(i + 3);
  polygons->Remove(next);
  polygons->Add(std::array{a, middle, b, apex});
  if (other.size == 3) {
    polygons->Add(std::array{a, y, b, middle});
    return {};
  }
  const std::array<int, 5> pentagon = {a, y, z, b, middle};
  if (CutPentagon(pentagon, *exit, polygons)) {
    return {true, polygons->WithSide((*exit)[0], (*exit)[1])};
  }
  // The middle has no edge to z yet.
  CutPentagon(pentagon, {z, b}, polygons);
  return {false, polygons->WithSide(z, b)};
}

// The triangle with side `side` goes across it. `exit`: the side that it takes next, if any.
Stepped StepAcross(const Side& side, const Side* exit, PolygonSet* polygons) {
  const auto [a, b] = side;
  const int here = polygons->WithSide(a, b), next = polygons->WithSide(b, a);
  if (next < 0 || polygons->IsCrease(a, b)) return CrossCrease(side, exit, polygons);
  const int apex = ApexOf((*polygons)[here], a);
  const Polygon other = (*polygons)[next];
  const int i = other.SideFrom(b);
  const int y = other.At(i + 2), z = other.At(i + 3);
  if (apex == y || (other.size == 4 && apex == z)) return {false, here};
  polygons->Remove(next);
  polygons->Remove(here);
  if (other.size == 3) {
    polygons->Add(std::array{a, y, b, apex});
    return {};
  }
  if (CutPentagon({a, y, z, b, apex}, *exit, polygons)) {
    return {true, polygons->WithSide((*exit)[0], (*exit)[1])};
  }
  polygons->Add(std::array{b, a, y, z});
  return {false, polygons->Add(std::array{a, b, apex})};
}

// Until it is part of a quad.
bool Walk(int triangle, PolygonSet* polygons) {
  std::set<Side> blocked;
  for (int tried = 0; tried < kPairTriangles.most_ways; ++tried) {
    const std::optional<std::vector<Side>> way = FindWay(*polygons, triangle, blocked);
    if (!way) return false;
    for (size_t step = 0; step < way->size(); ++step) {
      const Side* const exit = step + 1 < way->size() ? &(*way)[step + 1] : nullptr;
      const Stepped stepped = StepAcross((*way)[step], exit, polygons);
      triangle = stepped.triangle;
      if (stepped.as_planned) continue;
      blocked.insert((*way)[step]);
      break;
    }
    if (triangle < 0) return true;
  }
  return false;
}

}  // namespace

bool PairTriangles(PolygonSet* polygons) {
  GreedyPairing(polygons).Run();
  for (int p = 0; p < polygons->size(); ++p) {
    if ((*polygons)[p].size == 3 && !Walk(p, polygons)) return false;
  }
  return true;
}

}  // namespace rilievo
