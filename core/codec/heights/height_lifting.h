// The wavelet transform of heights on nested levels, by lifting (Sweldens 1998; on subdivision
// meshes Schroeder and Sweldens 1995): new edge vertices are predicted from the coarser level, the
// details that remain then update the old vertices, so that those become averages instead of
// samples. A detail's basis function then has no mean, details of different levels are nearly
// orthogonal, and the squared errors of their quantisation add up.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/codec/heights/edge_rules.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/refinement.h"

namespace rilievo {

// How one level's vertices are made from those of the level before.
struct LiftingStep {
  int rule = 1;      // of kEdgeRules
  int strength = 8;  // of the update, in 1/8 of what takes a detail's mean away; [0, 15]
};

// One detail d on an edge adds strength / 8 * 3 / (4 n) * d to the average of an end of valence n:
// the detail's basis function weighs 2 (in thirds of the finer level's faces), the end's 4 n / 3.
// In 1/65536.
int64_t UpdateWeight(int strength, int valence);

// Decoder's side, integers only. `values` holds the averages of `topology`'s vertices, then one
// detail an edge; both turn into heights of the finer level.
void SynthesizeLevel(const MeshTopology& topology, const LiftingStep& step,
                     std::span<int32_t> values);

// Encoder's side: the same transform in floating point, its inverse and its adjoint, over all
// levels. Values are indexed by vertex of the finest level.
class HeightLifting {
 public:
  // `max_level` <= refinement.max_level() + 1; the refinement must outlive this.
  HeightLifting(const LoopRefinement& refinement, int max_level);

  int max_level() const { return static_cast<int>(levels_.size()); }
  // Level `l` >= 1 makes the values [begin(l), end(l)); level 0 those of the control vertices.
  int begin(int l) const { return l == 0 ? 0 : vertex_counts_[l - 1]; }
  int end(int l) const { return vertex_counts_[l]; }
  const LiftingStep& step(int l) const { return levels_[l - 1].step; }
  void set_strength(int strength);
  void set_steps(const std::vector<LiftingStep>& steps);  // of levels 1, 2, ...

  // Of a level's |details|, for each rule.
  using RuleSums = std::array<double, kEdgeRules.size()>;
  // Heights to averages and details. Chooses for each level the rule that leaves the smallest sum
  // of |details|, each times the entry of `importance` for its vertex. The sums of levels 1, 2, ...
  std::vector<RuleSums> AnalyzeAndChoose(std::span<const double> importance,
                                         std::span<double> values);
  void Analyze(std::span<double> values) const;
  void Synthesize(std::span<double> values) const;
  // The transpose of Synthesize.
  void Adjoint(std::span<double> values) const;

 private:
  struct Level {
    LiftingStep step;
    const MeshTopology* coarse = nullptr;  // the level before
    std::vector<double> update;            // of its vertices, at strength 8
    std::vector<uint8_t> reach;            // of its edges: how much of the stencil is there, 0 to 2
  };
  static const EdgeRule& RuleOf(const Level& level, int edge);
  static void AddPredicted(const Level& level, double sign, std::span<double> values);
  static void AddTransposedPredicted(const Level& level, std::span<double> values);
  static void AddUpdates(const Level& level, double sign, std::span<double> values);

  std::vector<Level> levels_;  // entry l - 1: level l
  std::vector<int> vertex_counts_;
};

}  // namespace rilievo
