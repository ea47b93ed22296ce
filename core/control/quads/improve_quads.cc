#include "core/control/quads/improve_quads.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "core/control/quads/settings.h"

namespace rilievo {
namespace {

using FourCorners = std::array<int, 4>;

FourCorners CornersFrom(const Polygon& polygon, int first) {
  const int i = polygon.SideFrom(first);
  return {polygon.At(i), polygon.At(i + 1), polygon.At(i + 2), polygon.At(i + 3)};
}

int FlatCorners(const PolygonSet& polygons, const FourCorners& quad, size_t first, size_t last) {
  int count = 0;
  for (size_t i = first; i <= last; ++i) count += IsFlatCorner(polygons, quad, i) ? 1 : 0;
  return count;
}

// Whether the vertex can lose an edge.
bool CanLose(const PolygonSet& polygons, int v) {
  return polygons.Valence(v) > (polygons.OnBoundary(v) ? 2 : 3);
}

// Other quads over the same ring of vertices.
struct RingTurn {
  std::vector<FourCorners> quads;
  int change = 0;  // in squared valences
  double squareness = 1;
  // Whether it is better than the quads that are there, whose worst is `was` square.
  bool Improves(double was) const {
    if (change < 0) return squareness >= std::min(kImproveQuads.square_enough, was);
    return change == 0 && squareness > 0 && squareness >= kImproveQuads.squarer * was;
  }
};

double LeastSquareness(const PolygonSet& polygons, const std::vector<FourCorners>& quads) {
  double least = 1;
  for (const FourCorners& quad : quads) least = std::min(least, SquarenessOf(polygons, quad));
  return least;
}

bool AreFlat(const PolygonSet& polygons, const std::vector<FourCorners>& quads) {
  for (size_t i = 0; i < quads.size(); ++i) {
    const FourCorners& next = quads[(i + 1) % quads.size()];
    if (CosineBetween(polygons, quads[i], next) < kImproveQuads.least_cosine) return false;
  }
  return true;
}

bool AreDistinct(std::vector<int> vertices) {
  std::sort(vertices.begin(), vertices.end());
  return std::adjacent_find(vertices.begin(), vertices.end()) == vertices.end();
}

void Replace(const std::vector<int>& old, const std::vector<FourCorners>& quads,
             PolygonSet* polygons) {
  for (const int p : old) polygons->Remove(p);
  for (const FourCorners& quad : quads) polygons->Add(quad);
}

// The edge between two quads, to the next corners of their hexagon either way.
bool TurnEdge(int a, int b, PolygonSet* polygons) {
  const int p = polygons->WithSide(a, b), q = polygons->WithSide(b, a);
  if (p < 0 || q < 0 || polygons->IsCrease(a, b)) return false;
  if (!CanLose(*polygons, a) || !CanLose(*polygons, b)) return false;
  const std::vector<FourCorners> before = {CornersFrom((*polygons)[p], a),
                                           CornersFrom((*polygons)[q], b)};
  const std::array<int, 6> ring = {a, before[1][2], before[1][3], b, before[0][2], before[0][3]};
  if (!AreFlat(*polygons, before) || !AreDistinct({ring.begin(), ring.end()})) return false;
  int was_flat = 0;
  for (const FourCorners& quad : before) was_flat += FlatCorners(*polygons, quad, 0, 3);
  const double was = LeastSquareness(*polygons, before);
  const auto at = [&](size_t i) { return ring[i % 6]; };
  std::optional<RingTurn> best;
  for (const size_t k : {1, 2}) {
    if (polygons->HasEdge(at(k), at(k + 3))) continue;
    RingTurn turn{
        {{at(k), at(k + 1), at(k + 2), at(k + 3)}, {at(k + 3), at(k + 4), at(k + 5), at(k)}}};
    // The new edge makes the other corners whole.
    int flat = -was_flat;
    for (const FourCorners& quad : turn.quads) flat += FlatCorners(*polygons, quad, 1, 2);
    turn.change = kImproveQuads.flat_corner_valence * flat +
                  polygons->ValenceChange(std::array{a, b}, std::array{at(k), at(k + 3)});
    turn.squareness = LeastSquareness(*polygons, turn.quads);
    if (!turn.Improves(was) || !AreFlat(*polygons, turn.quads)) continue;
    if (best &&
        std::pair(turn.change, -turn.squareness) >= std::pair(best->change, -best->squareness)) {
      continue;
    }
    best = std::move(turn);
  }
  if (best) Replace({p, q}, best->quads, polygons);
  return best.has_value();
}

// All edges of a vertex inside, to the corners opposite to it. `v`: a corner of quad p.
bool TurnVertex(int p, int v, PolygonSet* polygons) {
  if (polygons->OnBoundary(v) || polygons->IsSharp(v)) return false;
  std::vector<int> old, ends, opposite, ring;
  std::vector<FourCorners> before;
  for (int at = p; old.empty() || at != p; at = polygons->WithSide(v, before.back()[3])) {
    old.push_back(at);
    before.push_back(CornersFrom((*polygons)[at], v));
    ends.push_back(before.back()[1]);
    opposite.push_back(before.back()[2]);
    if (!CanLose(*polygons, ends.back()) || polygons->HasEdge(v, opposite.back())) return false;
  }
  ring = ends;
  ring.insert(ring.end(), opposite.begin(), opposite.end());
  if (!AreDistinct(ring) || !AreFlat(*polygons, before)) return false;
  RingTurn turn;
  int flat = 0;
  for (size_t i = 0; i < before.size(); ++i) {
    turn.quads.push_back(
        {v, opposite[(i + before.size() - 1) % before.size()], ends[i], opposite[i]});
    flat +=
        FlatCorners(*polygons, turn.quads.back(), 2, 2) - FlatCorners(*polygons, before[i], 0, 3);
  }
  turn.change = kImproveQuads.flat_corner_valence * flat + polygons->ValenceChange(ends, opposite);
  turn.squareness = LeastSquareness(*polygons, turn.quads);
  const double was = LeastSquareness(*polygons, before);
  if (!turn.Improves(was) || !AreFlat(*polygons, turn.quads)) return false;
  Replace(old, turn.quads, polygons);
  return true;
}

// `v`: a corner of quad p. The tip of a cone stays, and so does a vertex without which the quad
// that is left would be folded.
bool TakeOut(int p, int v, PolygonSet* polygons) {
  if (polygons->Valence(v) != 2 || polygons->OnBoundary(v) || polygons->IsSharp(v)) return false;
  const FourCorners here = CornersFrom((*polygons)[p], v);
  const int q = polygons->WithSide(here[1], v);
  const FourCorners there = CornersFrom((*polygons)[q], v);
  if (q == p || there[2] == here[2]) return false;
  const FourCorners left = {here[1], here[2], here[3], there[2]};
  for (const FourCorners& quad : {here, there}) {
    if (CosineBetween(*polygons, quad, left) < kImproveQuads.least_cosine_of_left) return false;
  }
  // It may bend inwards where one of the two does.
  const double was = LeastSquareness(*polygons, {here, there});
  if (SquarenessOf(*polygons, left) < std::min(0.0, was)) return false;
  polygons->Remove(p);
  polygons->Remove(q);
  polygons->Add(left);
  return true;
}

}  // namespace

// Each turn lowers the squared valences, or keeps them and makes the worst quad squarer: this ends.
void ImproveQuads(PolygonSet* polygons) {
  for (bool changed = true; changed;) {
    changed = false;
    for (int p = 0; p < polygons->size(); ++p) {
      for (int i = 0; i < (*polygons)[p].size; ++i) {
        const int from = (*polygons)[p].At(i), to = (*polygons)[p].At(i + 1);
        if (!TakeOut(p, from, polygons) && !(from < to && TurnEdge(from, to, polygons)) &&
            !TurnVertex(p, from, polygons)) {
          continue;
        }
        changed = true;
        break;
      }
    }
  }
}

}  // namespace rilievo
