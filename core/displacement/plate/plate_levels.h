// A thin plate over every level of the domain, and values on their vertices.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"

namespace rilievo {

// The rows of the plate on one level. Row v says how far the height bends at v:
//   bend(v) = sum over the slots of v: factor * height[neighbor] - height[v],
// a mean over the ring in which each height counts by the cosine between its normal and that of v.
// On a rim, and along a crease, the mean is of the two neighbours along it: across, the surface is
// free to bend. Corners have no row.
struct PlateLevel {
  std::vector<int> begin;     // vertex v has the slots [begin[v], begin[v + 1])
  std::vector<int> neighbor;  // per slot, in the order of the ring
  std::vector<float> factor;  // per slot: of the neighbour in the row of the vertex
  std::vector<float> back;    // per slot: of the vertex in the row of the neighbour
  // Per vertex: one over the mean square of its edges, unit frame, each with its weight in the row;
  // 0 where there is no row.
  std::vector<float> inverse_edge2;
  double mean_edge = 0;
  int vertex_count() const { return static_cast<int>(inverse_edge2.size()); }
};

// Of level 0 to the finest. `rings`, `limit`: of the finest level.
absl::StatusOr<std::vector<PlateLevel>> BuildPlateLevels(const LoopRefinement& refinement,
                                                         const LevelRings& rings,
                                                         const LimitSurface& limit,
                                                         const RunContext& context);

// bend(v) of the values at v.
double BendAt(const PlateLevel& level, const std::vector<double>& heights, int vertex);

// Values of level `from` on level `to` >= from: a vertex on an edge has the mean of its ends.
std::vector<double> Prolong(const LoopRefinement& refinement, int from, int to,
                            std::vector<double> values);

// The transpose of Prolong, from level `from` down to `to`: sums of level `from` for the vertices
// of level `to`.
std::vector<double> Restrict(const LoopRefinement& refinement, int from, int to,
                             std::vector<double> sums);

}  // namespace rilievo
