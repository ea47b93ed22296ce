#include "core/domain/fit_rounds.h"

#include <cmath>
#include <cstdint>

#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/domain/drift_guard.h"
#include "core/domain/fold_guard.h"

namespace rilievo {

absl::Status StartRounds(const DomainSamples& samples, const Eigen::Matrix3Xd& control_points,
                         const RunContext& context, FootPointSearch* search, FitState* state) {
  state->control_points = control_points;
  RILIEVO_RETURN_IF_ERROR(SampleSurface(samples, control_points, context, &state->surface));
  RILIEVO_ASSIGN_OR_RETURN(state->gaps_at_start, GapsToPoints(search->cloud(), search->index(),
                                                              samples, state->surface, context));
  RILIEVO_RETURN_IF_ERROR(search->Update(state->surface, context, &state->feet));
  state->rms.assign(1, search->cloud_rms());
  return absl::OkStatus();
}

absl::Status TakeRound(const DomainSamples& samples, const std::function<void()>& move,
                       double worst_ratio, const RunContext& context, FootPointSearch* search,
                       FitState* state, bool* taken) {
  const Eigen::Matrix3Xd before = state->control_points;
  std::vector<uint8_t> folds_before;
  const auto move_points = [&] {
    move();
    return absl::OkStatus();
  };
  const auto find_folds = [&] {
    folds_before = FindFolds(samples, state->surface, context);
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, move_points, find_folds));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  *taken = state->control_points.allFinite();
  if (*taken) {
    Eigen::Matrix3Xd& points = state->control_points;
    RILIEVO_RETURN_IF_ERROR(SampleSurface(samples, points, context, &state->surface));
    RILIEVO_ASSIGN_OR_RETURN(
        const std::vector<float> gaps,
        GapsToPoints(search->cloud(), search->index(), samples, state->surface, context));
    RILIEVO_RETURN_IF_ERROR(
        UndoDrift(samples, before, state->gaps_at_start, gaps, context, &points, &state->surface));
    RILIEVO_RETURN_IF_ERROR(
        UndoFolds(samples, before, folds_before, context, &points, &state->surface));
    RILIEVO_RETURN_IF_ERROR(search->Update(state->surface, context, &state->feet));
    *taken = worst_ratio <= 0 || search->cloud_rms() <= worst_ratio * state->rms.back();
  }
  if (!*taken) {
    state->control_points = before;
    RILIEVO_RETURN_IF_ERROR(SampleSurface(samples, before, context, &state->surface));
    return search->Update(state->surface, context, &state->feet);
  }
  state->rms.push_back(search->cloud_rms());
  state->largest_move =
      std::sqrt((state->control_points - before).colwise().squaredNorm().maxCoeff());
  return absl::OkStatus();
}

}  // namespace rilievo
