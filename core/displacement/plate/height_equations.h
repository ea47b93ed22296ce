// The normal equations of the heights, on every level, and their solution.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/feet/point_feet.h"
#include "core/displacement/plate/plate_levels.h"
#include "core/loop/refinement.h"

namespace rilievo {

inline double Square(double x) { return x * x; }

// What points and domain say on one level,
//   sum over points a (sum weight[k] height[corner[k]] - offset)^2 + sum over vertices d height^2,
// as the matrix and the right side of its gradient. Only corners of one triangle meet in a point,
// so the matrix has an entry for each slot of the level.
struct PointTerm {
  std::vector<float> diagonal;    // per vertex
  std::vector<float> slot;        // per slot
  std::vector<float> right_side;  // per vertex
};

// On the levels from `first` on, for heights of a coarser level prolonged to the finest; the
// others' are left empty. `weights`: a, one for each foot; `domain_weight`: d. Where `measured` is
// 0, per vertex of the finest level, neither points nor the domain say anything; empty: 1 all over.
absl::StatusOr<std::vector<PointTerm>> AssemblePointTerms(
    const LoopRefinement& refinement, const std::vector<PlateLevel>& levels, int first,
    const std::vector<PointFoot>& feet, const std::vector<float>& weights, double domain_weight,
    const std::vector<uint8_t>& measured, const RunContext& context);

// What a plate on one level resists, per vertex:
//   sum bend[v] bend(v)^2 + stretch(v) sum over the neighbours n (height[n] - height[v])^2
//     + pull(v) height[v]^2.
struct Stiffness {
  // stretch(v) and pull(v): 0 but where the plate alone tells the heights.
  float StretchAt(int v) const { return MultipleOfBend(stretch_of_bend, v); }
  float PullAt(int v) const { return MultipleOfBend(pull_of_bend, v); }

  std::vector<float> bend;
  double stretch_of_bend = 0, pull_of_bend = 0;
  // Per vertex of the finest level, the first of which are those of this level: where 0, the plate
  // alone tells the heights. Empty: it does so nowhere. Must outlive this.
  std::span<const uint8_t> measured;

 private:
  float MultipleOfBend(double multiple, int v) const {
    return measured.empty() || measured[v] != 0 ? 0 : static_cast<float>(multiple * bend[v]);
  }
};

// Moves `heights` towards the minimum of the points' and the plate's terms, by at most `steps` of
// conjugate gradients, preconditioned by the diagonal.
absl::Status RelaxHeights(const PlateLevel& level, const PointTerm& points,
                          const Stiffness& stiffness, int steps, const RunContext& context,
                          std::vector<float>* heights);

}  // namespace rilievo
