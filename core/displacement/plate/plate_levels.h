// A thin plate over every level of the domain, and values on their vertices.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"

namespace rilievo {

// The rows of the plate on one level. Row v says how far the height bends at v:
//   bend(v) = mean over the neighbours: cosine * height[neighbor] - height[v],
// where the cosine is that between the normals of the two. On a rim, and along a crease, the mean
// is of the two neighbours along it: across, the surface is free to bend. Corners have no row.
struct PlateLevel {
  // Of a vertex and a neighbour: the cosine between their normals where the neighbour has a part in
  // the row of the vertex, and where the vertex has one in that of the neighbour.
  class Slot {
   public:
    Slot() = default;
    Slot(double cosine, bool in_row, bool in_other_row) {
      const auto rounded = static_cast<int16_t>(std::lround(cosine * kOne));
      if (in_row) in_row_ = rounded;
      if (in_other_row) in_other_row_ = rounded;
    }
    // The cosine, 0 where there is no part.
    float InRow() const { return in_row_ * (1 / kOne); }
    float InOtherRow() const { return in_other_row_ * (1 / kOne); }

   private:
    // Another scale would change the heights.
    static constexpr float kOne = 8191;
    // Two, of which one would do with two bits more: nothing is unpacked where most time goes.
    int16_t in_row_ = 0, in_other_row_ = 0;
  };
  std::vector<uint32_t> begin;  // vertex v has the slots [begin[v], begin[v + 1])
  std::vector<int> neighbor;    // per slot, in the order of the ring
  std::vector<Slot> slot;
  std::vector<float> row_size;  // per vertex: neighbours with a part in its row
  // Per vertex: one over the mean square of its edges, unit frame; 0 where there is no row.
  std::vector<float> inverse_edge2;
  double mean_edge = 0;
  int vertex_count() const { return static_cast<int>(inverse_edge2.size()); }
};

// Of level 0 to the finest. `rings`, `limit`: of the finest level.
absl::StatusOr<std::vector<PlateLevel>> BuildPlateLevels(const LoopRefinement& refinement,
                                                         const LevelRings& rings,
                                                         const LimitSurface& limit,
                                                         const RunContext& context);

// bend(v) of the values at v, which has a row.
inline float BendAt(const PlateLevel& level, const std::vector<float>& heights, int vertex) {
  float sum = 0;
  for (uint32_t s = level.begin[vertex]; s < level.begin[vertex + 1]; ++s) {
    sum += level.slot[s].InRow() * heights[level.neighbor[s]];
  }
  return sum / level.row_size[vertex] - heights[vertex];
}

// Values of level `from` on level `to` >= from: a vertex on an edge has the mean of its ends.
std::vector<float> Prolong(const LoopRefinement& refinement, int from, int to,
                           std::vector<float> values);

// The transpose of Prolong, from level `from` down to `to`: sums of level `from` for the vertices
// of level `to`.
std::vector<float> Restrict(const LoopRefinement& refinement, int from, int to,
                            std::vector<float> sums);

}  // namespace rilievo
