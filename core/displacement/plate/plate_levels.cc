#include "core/displacement/plate/plate_levels.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/loop/split_normals.h"

namespace rilievo {
namespace {

// Edges of one level along which the surface is sharp: each twice, as (end, other end), ascending.
using CreaseEdges = std::vector<std::pair<int, int>>;

CreaseEdges CreaseEdgesOfLevel(const LoopRefinement& refinement, int level) {
  CreaseEdges edges;
  if (refinement.sharp.empty()) return edges;
  const auto add = [&](int a, int b) {
    edges.emplace_back(a, b);
    edges.emplace_back(b, a);
  };
  const int from = std::max(0, level - 1);
  const MeshTopology& topology = refinement.levels[from];
  for (const SharpEdge& sharp : refinement.sharp.levels[from].edges) {
    if (sharp.sharpness < kInfiniteSharpness) continue;
    const auto ends = topology.edge_vertices.col(sharp.edge);
    if (level == 0) {
      add(ends[0], ends[1]);
    } else {
      for (const int end : ends) add(end, topology.vertex_count + sharp.edge);
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

class LevelBuilder {
 public:
  LevelBuilder(const MeshTopology& topology, const LevelRings& rings, const LimitSurface& limit,
               const SharpSectors& sectors, CreaseEdges crease_edges)
      : topology_(topology),
        rings_(rings),
        limit_(limit),
        sharp_(topology.vertex_count, 0),
        crease_edges_(std::move(crease_edges)) {
    for (const int v : sectors.vertices) sharp_[v] = 1;
    // At the end of a crease the surface is smooth.
    std::erase_if(crease_edges_, [&](const std::pair<int, int>& edge) {
      return sharp_[edge.first] == 0 || sharp_[edge.second] == 0;
    });
  }

  absl::StatusOr<PlateLevel> Build(const RunContext& context) {
    const int count = topology_.vertex_count;
    level_.begin.assign(count + 1, 0);
    for (int v = 0; v < count; ++v) level_.begin[v + 1] = level_.begin[v] + topology_.valence[v];
    level_.neighbor.resize(level_.begin.back());
    level_.slot.resize(level_.begin.back());
    level_.row_size.assign(count, 0.0f);
    level_.inverse_edge2.assign(count, 0.0f);
    std::vector<float> edge(count);
    RILIEVO_RETURN_IF_ERROR(ParallelForEach(
        count, kLightBlock, context, [&](int64_t v) { edge[v] = FillRow(static_cast<int>(v)); }));
    for (const float length : edge) level_.mean_edge += length / count;
    return std::move(level_);
  }

 private:
  // Which neighbours have a part in the row of a vertex.
  class Row {
   public:
    Row(const LevelBuilder& level, int v)
        : level_(level),
          v_(v),
          ring_(level.rings_.Of(v)),
          sharp_(level.sharp_[v] != 0),
          rim_(level.topology_.boundary_vertex[v] != 0) {
      if (!sharp_) return;
      along_crease_ = std::count_if(ring_.begin(), ring_.end(),
                                    [&](int n) { return level.IsCrease(v, n); }) == 2;
    }
    const Ring& ring() const { return ring_; }
    bool Has(int place) const {
      if (sharp_) return along_crease_ && level_.IsCrease(v_, ring_[place]);
      return !rim_ || place == 0 || place + 1 == ring_.size();
    }

   private:
    const LevelBuilder& level_;
    int v_;
    Ring ring_;
    bool sharp_, rim_, along_crease_ = false;
  };

  // Returns the root mean square of the edges there.
  float FillRow(int v) {
    const Row row(*this, v);
    const Ring& ring = row.ring();
    double edge2 = 0;
    for (int j = 0; j < ring.size(); ++j) {
      const uint32_t s = level_.begin[v] + j;
      const int n = ring[j];
      const double cosine = limit_.normals.col(n).dot(limit_.normals.col(v));
      level_.neighbor[s] = n;
      level_.slot[s] = PlateLevel::Slot(cosine, row.Has(j), RowHas(n, v));
      level_.row_size[v] += row.Has(j) ? 1 : 0;
      edge2 += (limit_.positions.col(n) - limit_.positions.col(v)).squaredNorm() / ring.size();
    }
    if (level_.row_size[v] > 0) {
      level_.inverse_edge2[v] = static_cast<float>(1 / std::max(edge2, 1e-20));
    }
    return static_cast<float>(std::sqrt(edge2));
  }

  bool IsCrease(int a, int b) const {
    return std::binary_search(crease_edges_.begin(), crease_edges_.end(), std::pair(a, b));
  }

  bool RowHas(int v, int neighbor) const {
    if (sharp_[v] == 0 && topology_.boundary_vertex[v] == 0) return true;
    const Row row(*this, v);
    const int* place = std::find(row.ring().begin(), row.ring().end(), neighbor);
    return row.Has(static_cast<int>(place - row.ring().begin()));
  }

  const MeshTopology& topology_;
  const LevelRings& rings_;
  const LimitSurface& limit_;
  std::vector<uint8_t> sharp_;  // on a crease, or a corner
  CreaseEdges crease_edges_;    // between these
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
    RILIEVO_ASSIGN_OR_RETURN(
        levels[l], LevelBuilder(topology, own, limit, sectors, CreaseEdgesOfLevel(refinement, l))
                       .Build(context));
  }
  return levels;
}

std::vector<float> Prolong(const LoopRefinement& refinement, int from, int to,
                           std::vector<float> values) {
  for (int l = from; l < to; ++l) {
    const MeshTopology& coarse = refinement.levels[l];
    values.resize(refinement.levels[l + 1].vertex_count);
    for (int e = 0; e < coarse.edge_count(); ++e) {
      const auto ends = coarse.edge_vertices.col(e);
      values[coarse.vertex_count + e] = 0.5f * (values[ends[0]] + values[ends[1]]);
    }
  }
  return values;
}

std::vector<float> Restrict(const LoopRefinement& refinement, int from, int to,
                            std::vector<float> sums) {
  for (int l = from - 1; l >= to; --l) {
    const MeshTopology& coarse = refinement.levels[l];
    for (int e = 0; e < coarse.edge_count(); ++e) {
      const float half = 0.5f * sums[coarse.vertex_count + e];
      const auto ends = coarse.edge_vertices.col(e);
      sums[ends[0]] += half;
      sums[ends[1]] += half;
    }
    sums.resize(coarse.vertex_count);
  }
  return sums;
}

}  // namespace rilievo
