#include "core/displacement/plate/height_equations.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>

#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/displacement/plate/settings.h"

namespace rilievo {
namespace {

PointTerm NoPoints(const PlateLevel& level) {
  return {std::vector<float>(level.vertex_count(), 0.0f),
          std::vector<float>(level.neighbor.size(), 0.0f),
          std::vector<float>(level.vertex_count(), 0.0f)};
}

// Adds to entry (row, column) of the matrix.
void AddTo(const PlateLevel& level, int row, int column, float value, PointTerm* term) {
  if (row == column) {
    term->diagonal[row] += value;
    return;
  }
  for (uint32_t s = level.begin[row]; s < level.begin[row + 1]; ++s) {
    if (level.neighbor[s] == column) term->slot[s] += value;
  }
}

// On the finest level.
PointTerm TermOf(const PlateLevel& level, const std::vector<PointFoot>& feet,
                 const std::vector<float>& weights, const std::vector<uint8_t>& measured,
                 const RunContext& context) {
  constexpr size_t kPointsAtOnce = 1 << 16;
  PointTerm term = NoPoints(level);
  const auto is_measured = [&](int v) { return measured.empty() || measured[v] != 0; };
  for (size_t i = 0; i < feet.size(); ++i) {
    if (i % kPointsAtOnce == 0 && !context.CheckStop().ok()) return term;
    const PointFoot& foot = feet[i];
    if (!foot.found() ||
        !std::any_of(std::begin(foot.corner), std::end(foot.corner), is_measured)) {
      continue;
    }
    for (int a = 0; a < 3; ++a) {
      const double weight = weights[i] * foot.weight[a];
      term.right_side[foot.corner[a]] += static_cast<float>(weight * foot.offset);
      for (int b = 0; b < 3; ++b) {
        AddTo(level, foot.corner[a], foot.corner[b], static_cast<float>(weight * foot.weight[b]),
              &term);
      }
    }
  }
  return term;
}

// What the heights of level `to` say, prolonged to the next one: with Prolong() as P, and the next
// level's term A and b, P^T A P and P^T b (the Galerkin operator of Briggs, Henson and McCormick, A
// Multigrid Tutorial). Row v comes of the next level's rows of v and, by half, of the middles of
// its edges, which are all that v has around it there.
absl::StatusOr<PointTerm> Coarser(const LoopRefinement& refinement, int to, const PlateLevel& level,
                                  const PlateLevel& next_level, const PointTerm& next,
                                  const RunContext& context) {
  const MeshTopology& topology = refinement.levels[to];
  PointTerm term = NoPoints(level);
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(level.vertex_count(), kLightBlock, context, [&](int64_t i) {
        const int v = static_cast<int>(i);
        const auto add = [&](int column, float value) {
          if (column < topology.vertex_count) return AddTo(level, v, column, value, &term);
          for (const int end : topology.edge_vertices.col(column - topology.vertex_count)) {
            AddTo(level, v, end, 0.5f * value, &term);
          }
        };
        const auto add_row = [&](int row, float share) {
          term.right_side[v] += share * next.right_side[row];
          add(row, share * next.diagonal[row]);
          for (uint32_t s = next_level.begin[row]; s < next_level.begin[row + 1]; ++s) {
            if (next.slot[s] != 0) add(next_level.neighbor[s], share * next.slot[s]);
          }
        };
        add_row(v, 1);
        for (uint32_t s = next_level.begin[v]; s < next_level.begin[v + 1]; ++s) {
          add_row(next_level.neighbor[s], 0.5f);
        }
      }));
  return term;
}

// Sums by blocks of a fixed length, so that the result does not depend on the threads.
absl::StatusOr<double> SumOver(int64_t count, const RunContext& context,
                               const std::function<double(int64_t, int64_t)>& sum_of) {
  std::vector<double> sums((count + kLightBlock - 1) / kLightBlock, 0.0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kLightBlock, context, [&](int64_t begin, int64_t end) {
    sums[begin / kLightBlock] = sum_of(begin, end);
  }));
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

class System {
 public:
  System(const PlateLevel& level, const PointTerm& points, const Stiffness& stiffness,
         const RunContext& context)
      : level_(level), points_(points), stiffness_(stiffness), context_(context) {
    values_.resize(level.vertex_count());
    diagonal_.resize(level.vertex_count());
    const bool has_membrane = !stiffness.measured.empty();
    if (has_membrane) in_membrane_.assign(level.vertex_count(), 0);
    for (int v = 0; v < level.vertex_count(); ++v) {
      double sum = points.diagonal[v] + stiffness.bend[v];
      if (has_membrane) sum += stiffness.PullAt(v);
      for (uint32_t s = level.begin[v]; s < level.begin[v + 1]; ++s) {
        const int n = level.neighbor[s];
        if (has_membrane) {
          const float stretch = stiffness.StretchAt(v) + stiffness.StretchAt(n);
          sum += stretch;
          if (stretch > 0) in_membrane_[v] = 1;
        }
        if (level.row_size[n] > 0)
          sum += stiffness.bend[n] * Square(level.slot[s].InOtherRow() / level.row_size[n]);
      }
      diagonal_[v] = sum > 0 ? static_cast<float>(sum) : 1.0f;
    }
  }

  float diagonal(int64_t v) const { return diagonal_[v]; }

  // Multiplies by the matrix; returns the product's dot with `x`.
  absl::StatusOr<double> Multiply(const std::vector<float>& x, std::vector<float>* product) {
    const int64_t count = level_.vertex_count();
    RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kLightBlock, context_, [&](int64_t v) {
      const float bend = stiffness_.bend[v];
      values_[v] = {x[v], bend > 0
                              ? bend * BendAt(level_, x, static_cast<int>(v)) / level_.row_size[v]
                              : 0.0f};
    }));
    return SumOver(count, context_, [&](int64_t begin, int64_t end) {
      double dot = 0;
      for (int64_t v = begin; v < end; ++v) {
        const Values& own = values_[v];
        float sum = points_.diagonal[v] * own.x - level_.row_size[v] * own.share;
        if (!in_membrane_.empty() && in_membrane_[v] != 0) {
          sum += MembraneAt(static_cast<int>(v), x);
        }
        for (uint32_t s = level_.begin[v]; s < level_.begin[v + 1]; ++s) {
          const Values& other = values_[level_.neighbor[s]];
          sum += points_.slot[s] * other.x + level_.slot[s].InOtherRow() * other.share;
        }
        (*product)[v] = sum;
        dot += double{sum} * own.x;
      }
      return dot;
    });
  }

 private:
  // Side by side, for the neighbours of a vertex are asked for both.
  struct Values {
    float x, share;  // share: what the vertex' row adds for each part in it
  };

  float MembraneAt(int v, const std::vector<float>& x) const {
    const float own = stiffness_.StretchAt(v);
    float sum = stiffness_.PullAt(v) * x[v];
    for (uint32_t s = level_.begin[v]; s < level_.begin[v + 1]; ++s) {
      const int n = level_.neighbor[s];
      sum += (own + stiffness_.StretchAt(n)) * (x[v] - x[n]);
    }
    return sum;
  }

  const PlateLevel& level_;
  const PointTerm& points_;
  const Stiffness& stiffness_;
  const RunContext& context_;
  std::vector<Values> values_;        // per vertex, of the latest Multiply()
  std::vector<float> diagonal_;       // per vertex
  std::vector<uint8_t> in_membrane_;  // per vertex: it or a neighbour has stretch; empty: none has
};

}  // namespace

absl::StatusOr<std::vector<PointTerm>> AssemblePointTerms(
    const LoopRefinement& refinement, const std::vector<PlateLevel>& levels, int first,
    const std::vector<PointFoot>& feet, const std::vector<float>& weights, double domain_weight,
    const std::vector<uint8_t>& measured, const RunContext& context) {
  const int finest = refinement.max_level();
  std::vector<PointTerm> terms(levels.size());
  terms[finest] = TermOf(levels[finest], feet, weights, measured, context);
  for (int l = finest - 1; l >= first; --l) {
    RILIEVO_ASSIGN_OR_RETURN(
        terms[l], Coarser(refinement, l, levels[l], levels[l + 1], terms[l + 1], context));
  }
  for (int l = first; l <= finest; ++l) {
    // A vertex stands for those of the finest level around it.
    const auto of_domain = static_cast<float>(std::ldexp(domain_weight, 2 * (finest - l)));
    for (int v = 0; v < levels[l].vertex_count(); ++v) {
      if (measured.empty() || measured[v] != 0) terms[l].diagonal[v] += of_domain;
    }
  }
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  return terms;
}

absl::Status RelaxHeights(const PlateLevel& level, const PointTerm& points,
                          const Stiffness& stiffness, int steps, const RunContext& context,
                          std::vector<float>* heights) {
  const int64_t count = level.vertex_count();
  System system(level, points, stiffness, context);
  std::vector<float> residual = points.right_side, image(count), direction(count);
  double right = 0;  // norms are in the preconditioner's metric
  for (int64_t v = 0; v < count; ++v) right += Square(residual[v]) / system.diagonal(v);
  RILIEVO_RETURN_IF_ERROR(system.Multiply(*heights, &image).status());
  double square = 0;
  for (int64_t v = 0; v < count; ++v) {
    residual[v] -= image[v];
    direction[v] = residual[v] / system.diagonal(v);
    square += double{residual[v]} * direction[v];
  }
  const double enough = kSolve.residual * kSolve.residual * right;
  for (int step = 0; step < steps && square > enough; ++step) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const double curvature, system.Multiply(direction, &image));
    if (!(curvature > 0)) break;
    const auto length = static_cast<float>(square / curvature);
    RILIEVO_ASSIGN_OR_RETURN(const double next,
                             SumOver(count, context, [&](int64_t begin, int64_t end) {
                               double sum = 0;
                               for (int64_t v = begin; v < end; ++v) {
                                 (*heights)[v] += length * direction[v];
                                 residual[v] -= length * image[v];
                                 sum += Square(residual[v]) / system.diagonal(v);
                               }
                               return sum;
                             }));
    const auto keep = static_cast<float>(next / square);
    RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kLightBlock, context, [&](int64_t v) {
      direction[v] = residual[v] / system.diagonal(v) + keep * direction[v];
    }));
    square = next;
  }
  return absl::OkStatus();
}

}  // namespace rilievo
