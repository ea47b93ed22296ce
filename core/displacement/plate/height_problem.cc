#include "core/displacement/plate/height_problem.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/displacement/feet/coarse_foot.h"
#include "core/displacement/plate/settings.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

// 1 at 0, a quarter at `scale` (Geman and McClure).
double RobustWeight(double distance, double scale) {
  return scale > 0 ? 1 / Square(1 + Square(distance / scale)) : 1;
}

// Per vertex of the finest level, the mean spacing of the points there. Where there are none, that
// of the finest level that has them.
std::vector<float> SpacingAtVertices(const OrientedCloud& cloud, const LoopRefinement& refinement,
                                     const std::vector<PointFoot>& feet) {
  const int finest = refinement.max_level();
  std::vector<float> sum(refinement.levels[finest].vertex_count, 0.0f), count(sum);
  for (size_t p = 0; p < cloud.spacing.size(); ++p) {
    if (!feet[p].found()) continue;
    const int v = CoarseFoot(feet[p], refinement, finest).NearestCorner();
    sum[v] += cloud.spacing[p];
    count[v] += 1;
  }
  std::vector<std::vector<float>> means(finest + 1);
  for (int l = finest; l >= 0; --l) {
    means[l].resize(sum.size());
    for (size_t v = 0; v < sum.size(); ++v) means[l][v] = count[v] > 0 ? sum[v] / count[v] : 0;
    if (l == 0) break;
    sum = Restrict(refinement, l, l - 1, std::move(sum));
    count = Restrict(refinement, l, l - 1, std::move(count));
  }
  std::vector<float> spacing(sum.size(), static_cast<float>(cloud.median_spacing));
  for (int l = 0; l <= finest; ++l) {
    if (l > 0) spacing = Prolong(refinement, l - 1, l, std::move(spacing));
    for (size_t v = 0; v < spacing.size(); ++v) {
      if (means[l][v] > 0) spacing[v] = means[l][v];
    }
  }
  return spacing;
}

}  // namespace

HeightProblem::HeightProblem(const OrientedCloud& cloud, const LoopRefinement& refinement,
                             const std::vector<PointFoot>& feet, std::vector<PlateLevel> levels)
    : cloud_(&cloud),
      refinement_(&refinement),
      feet_(&feet),
      levels_(std::move(levels)),
      spacing_(SpacingAtVertices(cloud, refinement, feet)),
      weights_(feet.size(), 1.0f) {}

double HeightProblem::SpacingOf(size_t foot) const {
  return foot < cloud_->spacing.size() ? cloud_->spacing[foot] : cloud_->median_spacing;
}

double HeightProblem::NoiseOf(size_t foot) const {
  return foot < cloud_->noise.size() ? cloud_->noise[foot] : 0;
}

double HeightProblem::MeanSpacing() const {
  return std::accumulate(spacing_.begin(), spacing_.end(), 0.0) /
         static_cast<double>(spacing_.size());
}

absl::Status HeightProblem::Assemble(int first, const RunContext& context) {
  Release();
  RILIEVO_ASSIGN_OR_RETURN(
      terms_, AssemblePointTerms(*refinement_, levels_, first, *feet_, weights_, domain_weight_,
                                 measured_, context));
  return absl::OkStatus();
}

Stiffness HeightProblem::StiffnessOf(int level, const std::vector<float>& lengths) const {
  const double kPlate = 32 * std::sqrt(3.0) / M_PI;
  const PlateLevel& plate = levels_[level];
  Stiffness stiffness;
  stiffness.bend.resize(plate.vertex_count());
  for (size_t v = 0; v < stiffness.bend.size(); ++v) {
    const double length = lengths.size() == 1 ? lengths[0] : lengths[v];
    stiffness.bend[v] = static_cast<float>(kPlate * Square(Square(length)) * Square(spacing_[v]) *
                                           plate.inverse_edge2[v]);
  }
  if (!measured_.empty()) {
    const double control_edge = std::ldexp(1.0, level);  // in edges of this level
    // On even triangles sum (height[n] - height[v])^2 is three squared edges times the squared
    // slope, and each edge is that of two vertices.
    stiffness.stretch_of_bend = 1 / (12 * Square(control_edge));
    stiffness.pull_of_bend =
        12 * stiffness.stretch_of_bend / Square(kSolve.height_range * control_edge);
    stiffness.measured = measured_;
  }
  return stiffness;
}

absl::Status HeightProblem::Relax(int level, const std::vector<float>& lengths, int steps,
                                  const RunContext& context, std::vector<float>* heights) const {
  return RelaxHeights(levels_[level], terms_[level], StiffnessOf(level, lengths), steps, context,
                      heights);
}

absl::StatusOr<std::vector<float>> HeightProblem::SolveUpTo(int level,
                                                            const std::vector<float>& lengths,
                                                            const RunContext& context,
                                                            const std::vector<float>* start) const {
  std::vector<float> heights(levels_.front().vertex_count(), 0.0);
  for (int l = 0; l <= level; ++l) {
    if (l > 0) heights = Prolong(*refinement_, l - 1, l, std::move(heights));
    if (l == finest() && start != nullptr) {
      for (size_t v = 0; v < heights.size(); ++v) {
        if (measured_.empty() || measured_[v] != 0) heights[v] = (*start)[v];
      }
    }
    RILIEVO_RETURN_IF_ERROR(Relax(l, lengths, kSolve.steps, context, &heights));
  }
  return heights;
}

absl::StatusOr<std::vector<float>> HeightProblem::Residuals(const std::vector<float>& heights,
                                                            const RunContext& context) const {
  std::vector<float> residuals(feet_->size(), 0.0f);
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(static_cast<int64_t>(residuals.size()), kLightBlock, context, [&](int64_t p) {
        const PointFoot& foot = (*feet_)[p];
        if (!foot.found()) return;
        double off = -foot.offset;
        for (int k = 0; k < 3; ++k) off += foot.weight[k] * heights[foot.corner[k]];
        residuals[p] = static_cast<float>(off);
      }));
  return residuals;
}

void HeightProblem::PreferNearPoints() {
  for (size_t p = 0; p < weights_.size(); ++p) {
    const double scale = kSolve.near_domain * SpacingOf(p);
    weights_[p] = static_cast<float>(RobustWeight((*feet_)[p].offset, scale));
  }
}

absl::Status HeightProblem::Reweigh(const std::vector<float>& heights, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> residuals, Residuals(heights, context));
  for (size_t p = 0; p < residuals.size(); ++p) {
    const double scale =
        kSolve.robust_residual * std::max(NoiseOf(p), kCommon.little_noise * SpacingOf(p));
    weights_[p] = static_cast<float>(RobustWeight(residuals[p], scale));
  }
  domain_weight_ = kSolve.domain_weight;
  return absl::OkStatus();
}

absl::StatusOr<std::vector<int>> HeightProblem::RegionOfPoints(int level,
                                                               const RunContext& context) const {
  std::vector<int> region(feet_->size(), -1);
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(static_cast<int64_t>(region.size()), kLightBlock, context, [&](int64_t p) {
        const PointFoot& foot = (*feet_)[p];
        if (foot.found()) region[p] = CoarseFoot(foot, *refinement_, level).NearestCorner();
      }));
  return region;
}

}  // namespace rilievo
