#include "core/codec/heights/height_lifting.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

double Prediction(const EdgeRule& rule, const EdgeStencil& stencil,
                  std::span<const double> values) {
  return WeightedSum(RuleAt(rule, stencil), stencil, values) / 32;
}

// Of a stencil: 0 where it has no more than the ends, 1 with both opposite vertices, 2 with all
// wings. Of a rule: what it asks for.
uint8_t ReachOf(const EdgeStencil& stencil) {
  return stencil.complete() ? 2 : stencil.interior() ? 1 : 0;
}
uint8_t ReachOf(const EdgeRule& rule) { return rule.wings != 0 ? 2 : rule.opposite != 0 ? 1 : 0; }

// The vertex that the face across edge `k` of `face` has beside that edge; -1 on the boundary.
int VertexBeyond(const MeshTopology& topology, int face, int k) {
  const int neighbor = topology.face_neighbors(k, face);
  if (neighbor < 0) return -1;
  return topology.faces.col(neighbor).sum() - topology.faces(k, face) -
         topology.faces((k + 1) % 3, face);
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
      beyond[k] = heights[VertexBeyond(topology, f, k)];
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
    level.coarse = &topology;
    level.reach.reserve(topology.edge_count());
    for (int e = 0; e < topology.edge_count(); ++e) {
      level.reach.push_back(ReachOf(StencilOfEdge(topology, e)));
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

const EdgeRule& HeightLifting::RuleOf(const Level& level, int edge) {
  const EdgeRule& rule = kEdgeRules[level.step.rule];
  return level.reach[edge] >= ReachOf(rule) ? rule : kEdgeRules[0];
}

// Adds `sign` times the prediction of each edge. Face by face, as SumOverFaces.
void HeightLifting::AddPredicted(const Level& level, double sign, std::span<double> values) {
  const MeshTopology& coarse = *level.coarse;
  const std::span<double> fine = values.subspan(coarse.vertex_count);
  for (int e = 0; e < coarse.edge_count(); ++e) {
    const double ends = values[coarse.edge_vertices(0, e)] + values[coarse.edge_vertices(1, e)];
    fine[e] += sign * RuleOf(level, e).ends / 32 * ends;
  }
  const EdgeRule& rule = kEdgeRules[level.step.rule];
  if (rule.opposite == 0 && rule.wings == 0) return;
  const double opposite = sign * rule.opposite / 32, wings = sign * rule.wings / 32;
  for (int f = 0; f < coarse.face_count(); ++f) {
    std::array<double, 3> beyond = {};
    if (wings != 0) {
      for (int k = 0; k < 3; ++k) {
        const int v = VertexBeyond(coarse, f, k);
        beyond[k] = v < 0 ? 0 : values[v];
      }
    }
    for (int k = 0; k < 3; ++k) {
      const int e = coarse.face_edges(k, f);
      if (level.reach[e] < ReachOf(rule)) continue;
      fine[e] += opposite * values[coarse.faces((k + 2) % 3, f)] +
                 wings * (beyond[(k + 1) % 3] + beyond[(k + 2) % 3]);
    }
  }
}

void HeightLifting::AddTransposedPredicted(const Level& level, std::span<double> values) {
  const MeshTopology& coarse = *level.coarse;
  const std::span<const double> fine = values.subspan(coarse.vertex_count);
  for (int e = 0; e < coarse.edge_count(); ++e) {
    const double share = RuleOf(level, e).ends / 32.0 * fine[e];
    values[coarse.edge_vertices(0, e)] += share;
    values[coarse.edge_vertices(1, e)] += share;
  }
  const EdgeRule& rule = kEdgeRules[level.step.rule];
  if (rule.opposite == 0 && rule.wings == 0) return;
  const double opposite = rule.opposite / 32.0, wings = rule.wings / 32.0;
  for (int f = 0; f < coarse.face_count(); ++f) {
    std::array<double, 3> details;
    for (int k = 0; k < 3; ++k) {
      const int e = coarse.face_edges(k, f);
      details[k] = level.reach[e] < ReachOf(rule) ? 0 : fine[e];
      values[coarse.faces((k + 2) % 3, f)] += opposite * details[k];
    }
    if (wings == 0) continue;
    for (int k = 0; k < 3; ++k) {
      const int v = VertexBeyond(coarse, f, k);
      if (v >= 0) values[v] += wings * (details[(k + 1) % 3] + details[(k + 2) % 3]);
    }
  }
}

// Adds `sign` times each detail's share to the ends of its edge.
void HeightLifting::AddUpdates(const Level& level, double sign, std::span<double> values) {
  const MeshTopology& coarse = *level.coarse;
  const double strength = sign * level.step.strength / 8;
  for (int e = 0; e < coarse.edge_count(); ++e) {
    for (int side = 0; side < 2; ++side) {
      const int v = coarse.edge_vertices(side, e);
      values[v] += strength * level.update[v] * values[coarse.vertex_count + e];
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
    const MeshTopology& coarse = *level.coarse;
    const int count = coarse.vertex_count;
    RuleSums& sums = of_levels[l - 1];
    sums.fill(0);
    for (int e = 0; e < coarse.edge_count(); ++e) {
      const EdgeStencil stencil = StencilOfEdge(coarse, e);
      for (size_t rule = 0; rule < kEdgeRules.size(); ++rule) {
        const double detail = values[count + e] - Prediction(kEdgeRules[rule], stencil, values);
        sums[rule] += std::abs(detail) * importance[count + e];
      }
    }
    level.step.rule = static_cast<int>(std::min_element(sums.begin(), sums.end()) - sums.begin());
    AddPredicted(level, -1, values);
    AddUpdates(level, 1, values);
  }
  return of_levels;
}

void HeightLifting::Analyze(std::span<double> values) const {
  for (int l = max_level(); l >= 1; --l) {
    AddPredicted(levels_[l - 1], -1, values);
    AddUpdates(levels_[l - 1], 1, values);
  }
}

void HeightLifting::Synthesize(std::span<double> values) const {
  for (const Level& level : levels_) {
    AddUpdates(level, -1, values);
    AddPredicted(level, 1, values);
  }
}

void HeightLifting::Adjoint(std::span<double> values) const {
  for (int l = max_level(); l >= 1; --l) {
    const Level& level = levels_[l - 1];
    const MeshTopology& coarse = *level.coarse;
    const int count = coarse.vertex_count;
    AddTransposedPredicted(level, values);
    const double strength = level.step.strength / 8.0;
    for (int e = 0; e < coarse.edge_count(); ++e) {
      for (int side = 0; side < 2; ++side) {
        const int v = coarse.edge_vertices(side, e);
        values[count + e] -= strength * level.update[v] * values[v];
      }
    }
  }
}

}  // namespace rilievo
