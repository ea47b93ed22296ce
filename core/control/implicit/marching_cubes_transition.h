// Marching cubes in a cell that touches smaller ones.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/control/implicit/grid_hierarchy.h"

namespace rilievo {

// The polygons of the zero set in a cell, put together face by face from numbered edges of it.
template <size_t kEdges>
class CellPolygons {
 public:
  CellPolygons() { next_.fill(-1); }

  // `corners`: of a face, counter-clockwise seen from outside. A step from a negative corner to a
  // positive one opens a segment, and the step back, just before the same run of negative corners
  // began, closes it: so negative runs stay apart. `edge_between`: the number of an edge by its
  // ends.
  template <typename IsNegative, typename EdgeBetween>
  void WalkFace(std::span<const int> corners, const IsNegative& is_negative,
                const EdgeBetween& edge_between) {
    const size_t size = corners.size();
    const auto at = [&](size_t k) { return corners[k % size]; };
    for (size_t k = 0; k < size; ++k) {
      if (!is_negative(at(k)) || is_negative(at(k + 1))) continue;
      size_t start = k + size;
      while (is_negative(at(start - 1))) --start;
      next_[edge_between(at(k), at(k + 1))] = edge_between(at(start - 1), at(start));
    }
  }

  // Clockwise seen from the positive side; none is left.
  std::vector<std::vector<int>> Take() {
    std::vector<std::vector<int>> polygons;
    for (size_t edge = 0; edge < kEdges; ++edge) {
      if (next_[edge] < 0) continue;
      std::vector<int>& polygon = polygons.emplace_back();
      for (auto e = static_cast<int>(edge); next_[e] >= 0;) {
        polygon.push_back(e);
        e = std::exchange(next_[e], -1);
      }
    }
    return polygons;
  }

 private:
  std::array<int, kEdges> next_;  // the edge that follows each
};

// An edge of a grid: from a node of a level along an axis.
struct GridEdge {
  int level = 0;
  int node = 0, next = 0;  // its two ends, numbers within the level
  int axis = 0;
};

// Closed polygons of grid edges, counter-clockwise seen from the negative side.
using EdgeLoops = std::vector<std::vector<GridEdge>>;

// Nodes of the next level in a cell, at x + 3 y + 9 z half cells; -1 for none.
using FinerNodes = std::array<int, 27>;

// Whether a cell is cut into eight on the next level: only then has its middle a node there.
inline bool IsRefined(const FinerNodes& finer) { return finer[13] >= 0; }

// True when an edge of the cell is cut by a node of the next level.
bool TouchesSmallerCells(const FinerNodes& finer);

// The polygons of the zero set in a leaf cell of `level` some of whose edges and faces are cut in
// two and four by the next level (after Kazhdan, Klein, Dalal and Hoppe 2007: a face is walked
// along its own finest edges, from either side alike, so there are no cracks). `corners`: as
// FindCell numbers them. A polygon of two edges encloses nothing and is left out.
EdgeLoops LoopsOfTransitionCell(const std::vector<GridLevel>& levels, int level,
                                const std::array<int, 8>& corners, const FinerNodes& finer);

}  // namespace rilievo
