#include <span>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/quad_surface.h"
#include "core/loop/sparse_rows.h"

namespace rilievo {
namespace {

// The vertices of one level after the other as rows of weights of the control vertices.
class QuadStencils {
 public:
  QuadStencils(const LoopRefinement& refinement, int level, const RunContext& context)
      : refinement_(refinement), level_(level), context_(context) {}

  absl::StatusOr<LimitStencils> Run() {
    for (int v = 0; v < ControlVertexCount(); ++v) {
      rows_.Push(v, {1.0});
      rows_.EndRow();
    }
    RILIEVO_RETURN_IF_ERROR(LimitsOfControlVertices());
    for (int level = 0; level < level_; ++level) {
      RILIEVO_RETURN_IF_ERROR(Step(level));
      RILIEVO_RETURN_IF_ERROR(LimitsOfNewVertices(level));
    }
    return std::move(limits_);
  }

 private:
  int ControlVertexCount() const { return refinement_.levels.front().vertex_count; }

  // Calls make(accumulator, begin, end, result) for blocks of [0, count); results in their order.
  template <int Width, typename Result, typename Make>
  absl::StatusOr<std::vector<Result>> InRuns(int count, const Make& make) const {
    std::vector<Result> results(static_cast<size_t>((count + kLightBlock - 1) / kLightBlock));
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count, kLightBlock, context_, [&](int64_t begin, int64_t end) {
          RowAccumulator<Width> row(ControlVertexCount());
          make(row, static_cast<int>(begin), static_cast<int>(end), results[begin / kLightBlock]);
        }));
    return results;
  }

  absl::Status Step(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const QuadStep step(refinement_, level);
    const auto make = [&](RowAccumulator<1>& row, int begin, int end, SparseRows<1>& rows) {
      rows.Reserve(end - begin);
      QuadRing ring;
      const auto add = [&](int vertex, double weight) { row.AddRow(rows_, vertex, {weight}); };
      for (int v = begin; v < end; ++v) {
        if (v < parent.vertex_count) {
          step.OldVertex(v, ring, add);
        } else {
          step.NewVertex(v - parent.vertex_count, add);
        }
        row.Flush([&](int control_vertex, const std::array<double, 1>& weight) {
          rows.Push(control_vertex, weight);
        });
        rows.EndRow();
      }
    };
    RILIEVO_ASSIGN_OR_RETURN(std::vector<SparseRows<1>> runs,
                             (InRuns<1, SparseRows<1>>(refinement_.vertex_count(level + 1), make)));
    rows_ = SparseRows<1>();
    for (SparseRows<1>& rows : runs) rows_.Append(std::exchange(rows, {}));
    return absl::OkStatus();
  }

  absl::Status LimitsOfControlVertices() {
    const QuadRings rings(refinement_.levels.front(), refinement_.quads, 0);
    const auto make = [&](RowAccumulator<3>& row, int begin, int end, LimitStencils& limits) {
      QuadRing ring;
      for (int v = begin; v < end; ++v) {
        rings.Of(v, ring);
        ring.neighbors.insert(ring.neighbors.end(), ring.opposite.begin(), ring.opposite.end());
        Add(row, v, ring.neighbors, QuadLimit(ring.sharp), limits);
      }
    };
    RILIEVO_ASSIGN_OR_RETURN(std::vector<LimitStencils> runs,
                             (InRuns<3, LimitStencils>(ControlVertexCount(), make)));
    return AppendStencils(std::move(runs), &limits_);
  }

  absl::Status LimitsOfNewVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const QuadLevel& quads = refinement_.quads.levels[level];
    const auto make = [&](RowAccumulator<3>& row, int begin, int end, LimitStencils& limits) {
      NewQuadLimits masks;
      for (int e = begin; e < end; ++e) {
        const NewQuadRing ring = RingOfNewVertex(parent, quads, e);
        Add(row, parent.vertex_count + e, std::span(ring.neighbors).first(ring.size),
            masks.Of(ring.boundary, quads.sharpness[e]), limits);
      }
    };
    RILIEVO_ASSIGN_OR_RETURN(std::vector<LimitStencils> runs,
                             (InRuns<3, LimitStencils>(parent.edge_count(), make)));
    return AppendStencils(std::move(runs), &limits_);
  }

  void Add(RowAccumulator<3>& row, int vertex, std::span<const int> neighbors,
           const SharpLimitMask& mask, LimitStencils& limits) const {
    const auto sum = [&](const SharpSector& sector) {
      for (size_t i = 0; i < mask.position.size(); ++i) {
        row.AddRow(rows_, i == 0 ? vertex : neighbors[i - 1],
                   {mask.position[i], sector.tangent_u[i], sector.tangent_v[i]});
      }
    };
    if (mask.sectors.size() > 1) {
      for (const SharpSector& sector : mask.sectors) {
        sum(sector);
        FlushSide(row, vertex, limits.sectors);
      }
    }
    sum(mask.whole);
    row.Flush([&](int control_vertex, const std::array<double, 3>& sums) {
      limits.control_vertices.push_back(control_vertex);
      limits.position.push_back(sums[0]);
      limits.tangent_u.push_back(sums[1]);
      limits.tangent_v.push_back(sums[2]);
    });
    limits.begin.push_back(static_cast<int>(limits.control_vertices.size()));
  }

  static void FlushSide(RowAccumulator<3>& row, int vertex, SectorStencils& sectors) {
    row.Flush([&](int control_vertex, const std::array<double, 3>& sums) {
      if (sums[1] == 0.0 && sums[2] == 0.0) return;
      sectors.control_vertices.push_back(control_vertex);
      sectors.tangent_u.push_back(sums[1]);
      sectors.tangent_v.push_back(sums[2]);
    });
    sectors.vertices.push_back(vertex);
    sectors.begin.push_back(static_cast<int>(sectors.control_vertices.size()));
  }

  const LoopRefinement& refinement_;
  const int level_;
  const RunContext& context_;
  SparseRows<1> rows_;  // of the level reached so far
  LimitStencils limits_;
};

}  // namespace

absl::StatusOr<LimitStencils> BuildQuadStencils(const LoopRefinement& refinement, int level,
                                                const RunContext& context) {
  return QuadStencils(refinement, level, context).Run();
}

}  // namespace rilievo
