// Where the edges of two solids meet each other's faces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/booleans/grid_solid.h"

namespace rilievo {

struct Crossing {
  size_t side;         // of the edge: 0 or 1
  uint32_t half_edge;  // of that solid, the lower one of its edge, which gives the direction
  int face;            // of the other solid
  bool enters;         // the other solid
  EdgeCrossing place;
};

struct SolidCrossings {
  std::vector<Crossing> all;  // by side and half-edge, each edge's in the order along it
  // By side and vertex: how many times the other solid is around it; 0 outside, 1 inside.
  std::array<std::vector<int>, 2> windings;
};

// All of them, in exact arithmetic. FAILED_PRECONDITION where a solid is wound around a place more
// than once, that is overlaps itself; CANCELLED.
absl::StatusOr<SolidCrossings> FindCrossings(const std::array<GridSolid, 2>& solids,
                                             const RunContext& context);

// Where the solids touch: an edge meets a face here and not where the points of a solid have moved
// the other way (`points_otherwise`), or there and not here. By number, the vertices of side 0,
// those of side 1, the crossings: 1 for the crossings and the corners of the faces that take part.
// Empty where nothing touches; CANCELLED.
absl::StatusOr<std::vector<uint8_t>> FindContacts(const std::array<GridSolid, 2>& solids,
                                                  const std::vector<Crossing>& crossings,
                                                  const RunContext& context);

}  // namespace rilievo
