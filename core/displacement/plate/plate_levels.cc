#include "core/displacement/plate/plate_levels.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/split_normals.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;

class LevelBuilder {
 public:
  LevelBuilder(const MeshTopology& topology, const LevelRings& rings, const LimitSurface& limit,
               const SharpSectors& sectors)
      : topology_(topology), rings_(rings), limit_(limit), sharp_(topology.vertex_count, 0) {
    for (const int v : sectors.vertices) sharp_[v] = 1;
  }

  absl::StatusOr<PlateLevel> Build(const RunContext& context) {
    const int count = topology_.vertex_count;
    level_.begin.assign(count + 1, 0);
    for (int v = 0; v < count; ++v) level_.begin[v + 1] = level_.begin[v] + topology_.valence[v];
    level_.neighbor.resize(level_.begin.back());
    level_.factor.assign(level_.begin.back(), 0.0f);
    level_.back.assign(level_.begin.back(), 0.0f);
    level_.inverse_edge2.assign(count, 0.0f);
    std::vector<float> edge(count);
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t v = begin; v < end; ++v) edge[v] = FillRow(static_cast<int>(v));
    }));
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t v = begin; v < end; ++v) FillBack(static_cast<int>(v));
    }));
    for (const float length : edge) level_.mean_edge += length / count;
    return std::move(level_);
  }

 private:
  // Returns the root mean square of the edges there.
  float FillRow(int v) {
    const Ring ring = rings_.Of(v);
    const bool rim = topology_.boundary_vertex[v] != 0;
    const auto on_crease =
        std::count_if(ring.begin(), ring.end(), [&](int n) { return sharp_[n] != 0; });
    double edge2 = 0;
    int in_row = 0;
    for (int j = 0; j < ring.size(); ++j) {
      const int slot = level_.begin[v] + j, n = ring[j];
      level_.neighbor[slot] = n;
      edge2 += (limit_.positions.col(n) - limit_.positions.col(v)).squaredNorm() / ring.size();
      const bool along_rim = j == 0 || j + 1 == ring.size();
      if (sharp_[v] ? !(on_crease == 2 && sharp_[n]) : rim && !along_rim) continue;
      level_.factor[slot] = static_cast<float>(limit_.normals.col(n).dot(limit_.normals.col(v)));
      ++in_row;
    }
    if (in_row > 0) {
      for (int s = level_.begin[v]; s < level_.begin[v + 1]; ++s) {
        level_.factor[s] /= static_cast<float>(in_row);
      }
      level_.inverse_edge2[v] = static_cast<float>(1 / std::max(edge2, 1e-20));
    }
    return static_cast<float>(std::sqrt(edge2));
  }

  void FillBack(int v) {
    for (int s = level_.begin[v]; s < level_.begin[v + 1]; ++s) {
      const int n = level_.neighbor[s];
      for (int t = level_.begin[n]; t < level_.begin[n + 1]; ++t) {
        if (level_.neighbor[t] == v) level_.back[s] = level_.factor[t];
      }
    }
  }

  const MeshTopology& topology_;
  const LevelRings& rings_;
  const LimitSurface& limit_;
  std::vector<uint8_t> sharp_;  // on a crease, or a corner
  PlateLevel level_;
};

}  // namespace

absl::StatusOr<std::vector<PlateLevel>> BuildPlateLevels(const LoopRefinement& refinement,
                                                         const LevelRings& rings,
                                                         const LimitSurface& limit,
                                                         const RunContext& context) {
  const int finest = refinement.max_level();
  std::vector<PlateLevel> levels(finest + 1);
  for (int l = 0; l <= finest; ++l) {
    const MeshTopology& topology = refinement.levels[l];
    const VertexRings table = l < finest ? BuildVertexRings(topology) : VertexRings();
    RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors, SectorsOfLevel(refinement, l));
    const LevelRings own = l < finest ? LevelRings(table) : rings;
    RILIEVO_ASSIGN_OR_RETURN(levels[l], LevelBuilder(topology, own, limit, sectors).Build(context));
  }
  return levels;
}

double BendAt(const PlateLevel& level, const std::vector<double>& heights, int vertex) {
  double bend = -heights[vertex];
  for (int s = level.begin[vertex]; s < level.begin[vertex + 1]; ++s) {
    bend += double{level.factor[s]} * heights[level.neighbor[s]];
  }
  return bend;
}

std::vector<double> Prolong(const LoopRefinement& refinement, int from, int to,
                            std::vector<double> values) {
  for (int l = from; l < to; ++l) {
    const MeshTopology& coarse = refinement.levels[l];
    values.resize(refinement.levels[l + 1].vertex_count);
    for (int e = 0; e < coarse.edge_count(); ++e) {
      const auto ends = coarse.edge_vertices.col(e);
      values[coarse.vertex_count + e] = 0.5 * (values[ends[0]] + values[ends[1]]);
    }
  }
  return values;
}

std::vector<double> Restrict(const LoopRefinement& refinement, int from, int to,
                             std::vector<double> sums) {
  for (int l = from - 1; l >= to; --l) {
    const MeshTopology& coarse = refinement.levels[l];
    for (int e = 0; e < coarse.edge_count(); ++e) {
      const double half = 0.5 * sums[coarse.vertex_count + e];
      const auto ends = coarse.edge_vertices.col(e);
      sums[ends[0]] += half;
      sums[ends[1]] += half;
    }
    sums.resize(coarse.vertex_count);
  }
  return sums;
}

}  // namespace rilievo
