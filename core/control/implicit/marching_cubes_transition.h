// Marching cubes in a cell that touches smaller ones.
#pragma once

#include <array>
#include <vector>

#include "core/control/implicit/grid_hierarchy.h"

namespace rilievo {

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
