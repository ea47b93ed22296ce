// One scan's heights as a family of least-squares problems, which differ in the weights of the
// points and in the stiffness of the plate.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/feet/point_feet.h"
#include "core/displacement/plate/height_equations.h"
#include "core/displacement/plate/plate_levels.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

class HeightProblem {
 public:
  // All feet weigh 1. What is given must outlive the problem, and `feet` may change between calls:
  // those of the points of `cloud`, and more, which are as far apart as these and without noise.
  HeightProblem(const OrientedCloud& cloud, const LoopRefinement& refinement,
                const std::vector<PointFoot>& feet, std::vector<PlateLevel> levels);

  // To be called before a solution, and once more when feet or weights have changed: for the levels
  // from `first` on.
  absl::Status Assemble(int first, const RunContext& context);

  // Heights of level `level` from those of the level before, all the way from the first; `lengths`:
  // the filter lengths, in spacings, per vertex of that level or a finer one (levels nest), or one
  // for all. `start`, or null: of the finest level, which begins with these where Fill() does not
  // make it fill.
  absl::StatusOr<std::vector<float>> SolveUpTo(int level, const std::vector<float>& lengths,
                                               const RunContext& context,
                                               const std::vector<float>* start = nullptr) const;
  // The same on `level` alone, from heights near the solution.
  absl::Status Relax(int level, const std::vector<float>& lengths, int steps,
                     const RunContext& context, std::vector<float>* heights) const;

  // How far each foot's point lies from the heights of the finest level, in the direction of its
  // row; 0 for those without a foot.
  absl::StatusOr<std::vector<float>> Residuals(const std::vector<float>& heights,
                                               const RunContext& context) const;
  // Where `measured` is 0, per vertex of the finest level, the plate alone tells the heights: with
  // a membrane, which lets slopes go, and a pull to the domain, which tells best what is far from
  // all points.
  void Fill(std::vector<uint8_t> measured) { measured_ = std::move(measured); }
  // Points far from the domain lose weight, so that of two sheets the nearer one counts.
  void PreferNearPoints();
  // Points far from the heights of the finest level lose weight; those without a foot weigh 1, for
  // when they get one.
  absl::Status Reweigh(const std::vector<float>& heights, const RunContext& context);

  // Per point, the vertex of `level` nearest to its foot; -1 where it has none.
  absl::StatusOr<std::vector<int>> RegionOfPoints(int level, const RunContext& context) const;

  const LoopRefinement& refinement() const { return *refinement_; }
  const std::vector<PlateLevel>& levels() const { return levels_; }
  const std::vector<PointFoot>& feet() const { return *feet_; }
  const std::vector<float>& weights() const { return weights_; }
  // Distance between the points there, per vertex of the finest level.
  const std::vector<float>& spacing() const { return spacing_; }
  double MeanSpacing() const;
  // Frees what Assemble made.
  void Release() { terms_ = {}; }
  int finest() const { return static_cast<int>(levels_.size()) - 1; }

 private:
  double SpacingOf(size_t foot) const;
  double NoiseOf(size_t foot) const;
  Stiffness StiffnessOf(int level, const std::vector<float>& lengths) const;

  const OrientedCloud* cloud_;
  const LoopRefinement* refinement_;
  const std::vector<PointFoot>* feet_;
  std::vector<PlateLevel> levels_;
  std::vector<float> spacing_;
  std::vector<float> weights_;     // per foot
  double domain_weight_ = 0;       // while points far from the domain weigh next to nothing
  std::vector<PointTerm> terms_;   // per level, of the weights
  std::vector<uint8_t> measured_;  // per vertex of the finest level; empty: all
};

}  // namespace rilievo
