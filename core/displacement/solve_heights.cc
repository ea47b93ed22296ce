#include "core/displacement/solve_heights.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/displacement/feet/crease_feet.h"
#include "core/displacement/feet/point_feet.h"
#include "core/displacement/plate/filter_lengths.h"
#include "core/displacement/plate/height_problem.h"
#include "core/displacement/plate/plate_levels.h"
#include "core/displacement/plate/settings.h"

namespace rilievo {
namespace {

// Per vertex of the finest level: 1 where one of `sources` lies within reach along the edges.
std::vector<uint8_t> WithinReach(const HeightProblem& problem, const LimitSurface& limit,
                                 const std::vector<uint8_t>& sources) {
  const PlateLevel& level = problem.levels().back();
  std::vector<float> away(sources.size(), std::numeric_limits<float>::infinity());
  std::vector<int> front, next;
  for (size_t v = 0; v < sources.size(); ++v) {
    if (sources[v] == 0) continue;
    away[v] = 0;
    front.push_back(static_cast<int>(v));
  }
  for (; !front.empty(); front.swap(next)) {
    next.clear();
    for (const int v : front) {
      for (uint32_t s = level.begin[v]; s < level.begin[v + 1]; ++s) {
        const int n = level.neighbor[s];
        const double edge = (limit.positions.col(n) - limit.positions.col(v)).norm();
        const auto distance = static_cast<float>(away[v] + edge);
        if (distance >= away[n] || distance > kSolve.reach * problem.spacing()[n]) continue;
        away[n] = distance;
        next.push_back(n);
      }
    }
  }
  std::vector<uint8_t> within(away.size());
  std::transform(away.begin(), away.end(), within.begin(),
                 [](float a) { return a < std::numeric_limits<float>::infinity() ? 1 : 0; });
  return within;
}

// Vertices under points, and those between them: a morphological closing, which leaves out what
// lies beside the points.
std::vector<uint8_t> MeasuredVertices(const HeightProblem& problem, const LimitSurface& limit) {
  std::vector<uint8_t> under(problem.levels().back().vertex_count(), 0);
  for (size_t p = 0; p < problem.feet().size(); ++p) {
    const PointFoot& foot = problem.feet()[p];
    if (!foot.found() || problem.weights()[p] < kSolve.least_weight) continue;
    for (const int v : foot.corner) under[v] = 1;
  }
  std::vector<uint8_t> far = WithinReach(problem, limit, under);
  for (uint8_t& flag : far) flag = flag == 0;
  const std::vector<uint8_t> beside = WithinReach(problem, limit, far);
  for (size_t v = 0; v < under.size(); ++v) under[v] |= beside[v] == 0;
  return under;
}

}  // namespace

absl::StatusOr<SolvedHeights> SolveHeights(const OrientedCloud& cloud,
                                           const LoopRefinement& refinement,
                                           const LevelRings& rings, const LimitSurface& limit,
                                           const DisplacementOptions& options,
                                           const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<PointFoot> feet,
                           FindFeet(cloud, refinement, rings, limit, options, context));
  RILIEVO_RETURN_IF_ERROR(AppendCreaseFeet(cloud, refinement, rings, limit, context, &feet));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<PlateLevel> levels,
                           BuildPlateLevels(refinement, rings, limit, context));
  HeightProblem problem(cloud, refinement, feet, std::move(levels));
  const int finest = problem.finest();
  const std::vector<float> first(1, 1.0f);
  problem.PreferNearPoints();
  RILIEVO_RETURN_IF_ERROR(problem.Assemble(0, context));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> heights, problem.SolveUpTo(finest, first, context));
  RILIEVO_RETURN_IF_ERROR(problem.Reweigh(heights, context));
  problem.Release();
  if (!IsLeftOut(Mechanism::kReachPoints)) {
    RILIEVO_RETURN_IF_ERROR(
        ReachPoints(cloud, refinement, limit, heights, problem.spacing(), context, &feet));
  }
  RILIEVO_RETURN_IF_ERROR(problem.Assemble(0, context));
  RILIEVO_ASSIGN_OR_RETURN(const FilterLengths filter, ChooseFilterLengths(problem, context));
  const std::vector<float>& lengths = filter.lengths;
  RILIEVO_ASSIGN_OR_RETURN(heights, problem.SolveUpTo(finest, lengths, context));
  RILIEVO_RETURN_IF_ERROR(problem.Reweigh(heights, context));
  SolvedHeights solved;
  solved.measured = MeasuredVertices(problem, limit);
  const auto& measured = solved.measured;
  if (std::find(measured.begin(), measured.end(), 0) != measured.end()) {
    problem.Fill(measured);
    RILIEVO_RETURN_IF_ERROR(problem.Assemble(0, context));
    RILIEVO_ASSIGN_OR_RETURN(heights, problem.SolveUpTo(finest, lengths, context, &heights));
  } else {
    RILIEVO_RETURN_IF_ERROR(problem.Assemble(finest, context));
    RILIEVO_RETURN_IF_ERROR(problem.Relax(finest, lengths, kSolve.steps, context, &heights));
  }
  solved.height = std::move(heights);
  solved.leverage = filter.leverage;
  solved.smoothed.resize(lengths.size());
  std::transform(lengths.begin(), lengths.end(), solved.smoothed.begin(),
                 [](float length) { return length > kSolve.smoothed ? 1 : 0; });
  return solved;
}

}  // namespace rilievo
