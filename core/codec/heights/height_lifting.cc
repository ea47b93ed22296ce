#include "core/codec/heights/height_lifting.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

double Prediction(int rule, const EdgeStencil& stencil, std::span<const double> values) {
  return WeightedSum(RuleAt(kEdgeRules[rule], stencil), stencil, values) / 32;
}

// 32 times each edge's prediction less that of its ends, for a closed mesh: face by face, since a
// face gives all three of its edges an opposite vertex and two wings.
std::vector<int32_t> SumOverFaces(const MeshTopology& topology, const EdgeRule& rule,
                                  std::span<const int32_t> heights) {
  std::vector<int32_t> sums(topology.edge_count(), 0);
  for (int f = 0; f < topology.face_count(); ++f) {
    const Eigen::Vector3i corners = topology.faces.col(f);
    std::array<int32_t, 3> beyond;  // height beyond the edge from corner k
    for (int k = 0; k < 3; ++k) {
      const int across = topology.faces.col(topology.face_neighbors(k, f)).sum();
      beyond[k] = heights[across - corners[k] - corners[(k + 1) % 3]];
    }
    for (int k = 0; k < 3; ++k) {
      sums[topology.face_edges(k, f)] += rule.opposite * heights[corners[(k + 2) % 3]] +
                                         rule.wings * (beyond[(k + 1) % 3] + beyond[(k + 2) % 3]);
    }
  }
  return sums;
}

void AddPredictions(const MeshTopology& topology, const EdgeRule& rule, std::span<int32_t> values) {
  const int coarse_count = topology.vertex_count;
  const bool closed = topology.face_neighbors.minCoeff() >= 0;
  if (!closed) {
    for (int e = 0; e < topology.edge_count(); ++e) {
      const EdgeStencil stencil = StencilOfEdge(topology, e);
      values[coarse_count + e] += (WeightedSum(RuleAt(rule, stencil), stencil, values) + 16) >> 5;
    }
    return;
  }
  const std::vector<int32_t> sums = SumOverFaces(topology, rule, values.first(coarse_count));
  for (int e = 0; e < topology.edge_count(); ++e) {
    const int32_t ends =
        values[topology.edge_vertices(0, e)] + values[topology.edge_vertices(1, e)];
    values[coarse_count + e] += (rule.ends * ends + sums[e] + 16) >> 5;
  }
}

}  // namespace

int64_t UpdateWeight(int strength, int valence) {
  return int64_t{strength} * 3 * 65536 / (32 * int64_t{valence});
}

void SynthesizeLevel(const MeshTopology& topology, const LiftingStep& step,
                     std::span<int32_t> values) {
  const int coarse_count = topology.vertex_count;
  if (step.strength != 0) {
    std::vector<int64_t> sums(coarse_count, 0);
    for (int e = 0; e < topology.edge_count(); ++e) {
      const int32_t detail = values[coarse_count + e];
      if (detail == 0) continue;
      sums[topology.edge_vertices(0, e)] += detail;
      sums[topology.edge_vertices(1, e)] += detail;
    }
    for (int v = 0; v < coarse_count; ++v) {
      if (sums[v] == 0) continue;
      const int64_t update = sums[v] * UpdateWeight(step.strength, topology.valence[v]);
      values[v] -= static_cast<int32_t>((update + 32768) >> 16);
    }
  }
  AddPredictions(topology, kEdgeRules[step.rule], values);
}

HeightLifting::HeightLifting(const LoopRefinement& refinement, int max_level) {
  vertex_counts_.push_back(refinement.levels[0].vertex_count);
  for (int l = 1; l <= max_level; ++l) {
    const MeshTopology& topology = refinement.levels[l - 1];
    Level level;
    level.coarse_count = topology.vertex_count;
    level.stencils.reserve(topology.edge_count());
    for (int e = 0; e < topology.edge_count(); ++e) {
      level.stencils.push_back(StencilOfEdge(topology, e));
    }
    for (int valence : topology.valence) {
      level.update.push_back(static_cast<double>(UpdateWeight(8, valence)) / 65536);
    }
    levels_.push_back(std::move(level));
    vertex_counts_.push_back(refinement.vertex_count(l));
  }
}

void HeightLifting::set_strength(int strength) {
  for (Level& level : levels_) level.step.strength = strength;
}

void HeightLifting::AnalyzeLevel(const Level& level, std::span<double> values) const {
  const int count = level.coarse_count, edges = static_cast<int>(level.stencils.size());
  for (int e = 0; e < edges; ++e) {
    values[count + e] -= Prediction(level.step.rule, level.stencils[e], values);
  }
  const double strength = level.step.strength / 8.0;
  for (int e = 0; e < edges; ++e) {
    for (int v : level.stencils[e].ends) {
      values[v] += strength * level.update[v] * values[count + e];
    }
  }
}

void HeightLifting::set_steps(const std::vector<LiftingStep>& steps) {
  for (size_t l = 0; l < levels_.size(); ++l) levels_[l].step = steps[l];
}

std::vector<HeightLifting::RuleSums> HeightLifting::AnalyzeAndChoose(
    std::span<const double> importance, std::span<double> values) {
  std::vector<RuleSums> of_levels(levels_.size());
  for (int l = max_level(); l >= 1; --l) {
    Level& level = levels_[l - 1];
    const int count = level.coarse_count, edges = static_cast<int>(level.stencils.size());
    RuleSums& sums = of_levels[l - 1];
    sums.fill(0);
    for (int e = 0; e < edges; ++e) {
      for (size_t rule = 0; rule < kEdgeRules.size(); ++rule) {
        const double detail =
            values[count + e] - Prediction(static_cast<int>(rule), level.stencils[e], values);
        sums[rule] += std::abs(detail) * importance[count + e];
      }
    }
    level.step.rule = static_cast<int>(std::min_element(sums.begin(), sums.end()) - sums.begin());
    AnalyzeLevel(level, values);
  }
  return of_levels;
}

void HeightLifting::Analyze(std::span<double> values) const {
  for (int l = max_level(); l >= 1; --l) AnalyzeLevel(levels_[l - 1], values);
}

void HeightLifting::Synthesize(std::span<double> values) const {
  for (const Level& level : levels_) {
    const int count = level.coarse_count, edges = static_cast<int>(level.stencils.size());
    const double strength = level.step.strength / 8.0;
    for (int e = 0; e < edges; ++e) {
      for (int v : level.stencils[e].ends) {
        values[v] -= strength * level.update[v] * values[count + e];
      }
    }
    for (int e = 0; e < edges; ++e) {
      values[count + e] += Prediction(level.step.rule, level.stencils[e], values);
    }
  }
}

void HeightLifting::Adjoint(std::span<double> values) const {
  for (int l = max_level(); l >= 1; --l) {
    const Level& level = levels_[l - 1];
    const int count = level.coarse_count, edges = static_cast<int>(level.stencils.size());
    for (int e = 0; e < edges; ++e) {
      const EdgeStencil& stencil = level.stencils[e];
      const EdgeRule rule = RuleAt(kEdgeRules[level.step.rule], stencil);
      const double share = values[count + e] / 32;
      for (int v : stencil.ends) values[v] += rule.ends * share;
      if (rule.opposite != 0) {
        for (int v : stencil.opposite) values[v] += rule.opposite * share;
      }
      if (rule.wings != 0) {
        for (int v : stencil.wings) values[v] += rule.wings * share;
      }
    }
    const double strength = level.step.strength / 8.0;
    for (int e = 0; e < edges; ++e) {
      for (int v : level.stencils[e].ends) {
        values[count + e] -= strength * level.update[v] * values[v];
      }
    }
  }
}

}  // namespace rilievo
