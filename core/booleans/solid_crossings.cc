#include "core/booleans/solid_crossings.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/booleans/box_tree.h"

namespace rilievo {
namespace {

std::vector<FloatBox> BoxesOf(const GridSolid& solid) {
  std::vector<FloatBox> boxes(static_cast<size_t>(solid.faces.cols()));
  for (size_t face = 0; face < boxes.size(); ++face) {
    boxes[face] = solid.BoxOf(static_cast<int>(face));
  }
  return boxes;
}

// Of the edges that belong to `edge_face`, the lower of their two faces, with a face of the other.
void CollectCrossings(const std::array<GridSolid, 2>& solids, size_t side, int edge_face,
                      int other_face, std::vector<Crossing>* found) {
  const GridSolid& solid = solids[side];
  const GridTriangle triangle = solids[1 - side].TriangleOf(other_face);
  for (uint32_t k = 0; k < 3; ++k) {
    const uint32_t h = 3 * static_cast<uint32_t>(edge_face) + k;
    if (solid.partner[h] < h) continue;
    const GridPoint &tail = solid.TailOf(h), &tip = solid.TipOf(h);
    if (!Meets(tail, tip, triangle)) continue;
    found->push_back(
        {side, h, other_face, SideOf(triangle, tail) > 0, EdgeCrossing(tail, tip, triangle)});
  }
}

bool ComesBefore(const Crossing& a, const Crossing& b) {
  const auto edge = [](const Crossing& crossing) {
    return std::tie(crossing.side, crossing.half_edge);
  };
  return edge(a) == edge(b) ? a.place.Before(b.place) : edge(a) < edge(b);
}

absl::StatusOr<std::vector<Crossing>> AllCrossings(const std::array<GridSolid, 2>& solids,
                                                   const BoxTree& tree, const RunContext& context) {
  const int64_t count = solids[0].faces.cols();
  std::vector<std::vector<Crossing>> of_block(
      static_cast<size_t>((count + kSearchBlock - 1) / kSearchBlock));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
        std::vector<Crossing>* found = &of_block[static_cast<size_t>(begin / kSearchBlock)];
        for (auto face = static_cast<int>(begin); face < end; ++face) {
          tree.ForEachOverlap(solids[0].BoxOf(face), [&](int other) {
            CollectCrossings(solids, 0, face, other, found);
            CollectCrossings(solids, 1, other, face, found);
          });
        }
      }));
  std::vector<Crossing> crossings;
  for (std::vector<Crossing>& block : of_block) {
    crossings.insert(crossings.end(), block.begin(), block.end());
    FreeMemoryOf(&block);
  }
  std::sort(crossings.begin(), crossings.end(), ComesBefore);
  return crossings;
}

// Side of the edge, its half-edge, face of the other solid.
using MeetingPair = std::tuple<size_t, uint32_t, int>;

std::vector<MeetingPair> MeetingPairsOf(const std::vector<Crossing>& crossings) {
  std::vector<MeetingPair> pairs;
  pairs.reserve(crossings.size());
  for (const Crossing& crossing : crossings) {
    pairs.emplace_back(crossing.side, crossing.half_edge, crossing.face);
  }
  return pairs;
}

// From what a line along x to beyond the solid meets.
int WindingAround(const GridPoint& point, const GridSolid& solid, const BoxTree& tree) {
  const GridPoint beyond = {{kMostGridCoordinate, point.at[1], point.at[2]}, ~uint32_t{0}};
  FloatBox box;
  for (size_t axis = 0; axis < 3; ++axis) {
    box.lo[axis] = FloatBox::RoundDown(static_cast<double>(point.at[axis]));
    box.hi[axis] = FloatBox::RoundUp(static_cast<double>(beyond.at[axis]));
  }
  int winding = 0;
  tree.ForEachOverlap(box, [&](int face) {
    const GridTriangle triangle = solid.TriangleOf(face);
    if (Meets(point, beyond, triangle)) winding -= SideOf(triangle, point);
  });
  return winding;
}

// By half-edge: how much deeper in the other solid its tip lies than its tail.
std::vector<int8_t> StepsAlong(const GridSolid& solid, size_t side,
                               const std::vector<Crossing>& crossings) {
  std::vector<int8_t> steps(solid.partner.size(), 0);
  for (const Crossing& crossing : crossings) {
    if (crossing.side != side) continue;
    steps[crossing.half_edge] += crossing.enters ? 1 : -1;
    steps[solid.partner[crossing.half_edge]] -= crossing.enters ? 1 : -1;
  }
  return steps;
}

absl::Status Overlapping() {
  return absl::FailedPreconditionError(
      "one of the shapes overlaps itself, so that inside and outside are not told; measure and "
      "mend it, or make it anew with another --max-error");
}

// One vertex of each piece is asked; from there on along the edges.
absl::StatusOr<std::vector<int>> WindingsOf(const GridSolid& solid, const GridSolid& other,
                                            const BoxTree& tree_of_other,
                                            const std::vector<int8_t>& steps,
                                            const RunContext& context) {
  constexpr int kUnknown = 1 << 20;
  std::vector<int> windings(solid.points.size(), kUnknown);
  std::vector<uint8_t> seen(solid.partner.size() / 3, 0);
  std::vector<uint32_t> open;
  for (size_t seed = 0; seed < seen.size(); ++seed) {
    if (seen[seed] != 0) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const auto first = static_cast<uint32_t>(3 * seed);
    int& at_seed = windings[static_cast<size_t>(Origin(solid.faces, first))];
    if (at_seed == kUnknown) at_seed = WindingAround(solid.TailOf(first), other, tree_of_other);
    seen[seed] = 1;
    open.assign(1, first);
    while (!open.empty()) {  // half-edges of faces whose tails are known
      uint32_t h = open.back();
      open.pop_back();
      for (int k = 0; k < 3; ++k, h = NextHalfEdge(h)) {
        const int tip = windings[static_cast<size_t>(Origin(solid.faces, h))] + steps[h];
        int& known = windings[static_cast<size_t>(Origin(solid.faces, NextHalfEdge(h)))];
        if (known == kUnknown) known = tip;
        if (known != tip || tip < 0 || tip > 1) return Overlapping();
        const uint32_t across = solid.partner[h];
        if (seen[across / 3] == 0) {
          seen[across / 3] = 1;
          open.push_back(NextHalfEdge(across));  // its tail is the tail of h
        }
      }
    }
  }
  return windings;
}

}  // namespace

absl::StatusOr<SolidCrossings> FindCrossings(const std::array<GridSolid, 2>& solids,
                                             const RunContext& context) {
  const BoxTree trees[2] = {BoxTree(BoxesOf(solids[0])), BoxTree(BoxesOf(solids[1]))};
  SolidCrossings found;
  RILIEVO_ASSIGN_OR_RETURN(found.all, AllCrossings(solids, trees[1], context));
  for (size_t side = 0; side < 2; ++side) {
    RILIEVO_ASSIGN_OR_RETURN(found.windings[side],
                             WindingsOf(solids[side], solids[1 - side], trees[1 - side],
                                        StepsAlong(solids[side], side, found.all), context));
  }
  return found;
}

absl::StatusOr<std::vector<uint8_t>> FindContacts(const std::array<GridSolid, 2>& solids,
                                                  const std::vector<Crossing>& crossings,
                                                  const RunContext& context) {
  std::array<GridSolid, 2> otherwise = solids;
  for (GridSolid& solid : otherwise) {
    if (!solid.points_otherwise.empty()) solid.points.swap(solid.points_otherwise);
  }
  const BoxTree tree(BoxesOf(otherwise[1]));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<Crossing> others,
                           AllCrossings(otherwise, tree, context));
  std::vector<MeetingPair> here = MeetingPairsOf(crossings), there = MeetingPairsOf(others), in_one;
  std::sort(here.begin(), here.end());
  std::sort(there.begin(), there.end());
  std::set_symmetric_difference(here.begin(), here.end(), there.begin(), there.end(),
                                std::back_inserter(in_one));
  std::vector<uint8_t> near;
  if (in_one.empty()) return near;
  const size_t begins[2] = {0, solids[0].points.size()};
  near.assign(begins[1] + solids[1].points.size(), 0);
  const auto mark = [&](size_t side, uint32_t face) {
    for (uint32_t h = 3 * face; h < 3 * face + 3; ++h) {
      near[begins[side] + static_cast<size_t>(Origin(solids[side].faces, h))] = 1;
    }
  };
  for (const auto& [side, half_edge, face] : in_one) {
    mark(side, half_edge / 3);
    mark(side, solids[side].partner[half_edge] / 3);
    mark(1 - side, static_cast<uint32_t>(face));
  }
  for (const MeetingPair& pair : MeetingPairsOf(crossings)) {
    near.push_back(std::binary_search(in_one.begin(), in_one.end(), pair));
  }
  return near;
}

}  // namespace rilievo
