#include "core/domain/fit_loop_domain.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/domain/domain_samples.h"
#include "core/domain/fit_rounds.h"
#include "core/domain/foot_points.h"
#include "core/domain/least_squares_fit.h"
#include "core/domain/settings.h"
#include "core/domain/suzuki_update.h"

namespace rilievo {
namespace {

absl::Status CheckRange(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, ": ", value, " is outside [", low, ", ", high, "]"));
}

// Samples in greater number than the cloud's points would only repeat them: the lowest level, from
// 1, that has as many, or the asked one, unless that has more than kFitLoopDomain.most_samples.
int SampleLevel(const ControlMesh& mesh, int64_t point_count, int asked) {
  int level = std::min(asked, 1);
  // A refinement has about half as many vertices as faces.
  int64_t samples = mesh.faces.cols() * (int64_t{1} << (2 * level)) / 2;
  for (; level < asked && samples < point_count && 4 * samples <= kFitLoopDomain.most_samples;
       ++level) {
    samples *= 4;
  }
  return level;
}

}  // namespace

absl::Status FitOptions::Validate() const {
  constexpr double kInfinity = std::numeric_limits<double>::max();
  RILIEVO_RETURN_IF_ERROR(CheckRange("suzuki_rounds", suzuki_rounds, 0, 50));
  if (!(suzuki_lambda > 0 && suzuki_lambda <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("suzuki_lambda: ", suzuki_lambda, " is outside (0, 1]"));
  }
  RILIEVO_RETURN_IF_ERROR(CheckRange("rounds", rounds, 1, 50));
  RILIEVO_RETURN_IF_ERROR(CheckRange("sample_level", sample_level, 0, 4));
  RILIEVO_RETURN_IF_ERROR(CheckRange("tangential_weight", tangential_weight, 0, 1));
  RILIEVO_RETURN_IF_ERROR(CheckRange("fairness_start", fairness_start, 0, kInfinity));
  RILIEVO_RETURN_IF_ERROR(CheckRange("fairness_end", fairness_end, 0, kInfinity));
  RILIEVO_RETURN_IF_ERROR(CheckRange("wanted_rms", wanted_rms, 0, kInfinity));
  if (!(robust_spacings > 0 && robust_spacings <= kInfinity)) {
    return absl::InvalidArgumentError(
        absl::StrCat("robust_spacings: ", robust_spacings, " is not a positive number"));
  }
  return absl::OkStatus();
}

absl::StatusOr<DomainFit> FitLoopDomain(const OrientedCloud& cloud, const PointIndex& index,
                                        const ControlMesh& start, const FitOptions& options,
                                        const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  const int level = SampleLevel(start, cloud.points.cols(), options.sample_level);
  RILIEVO_ASSIGN_OR_RETURN(const DomainSamples samples, BuildDomainSamples(start, level, context));
  FootPointSearch search(cloud, index, samples, options.robust_spacings);

  FitState state;
  RILIEVO_RETURN_IF_ERROR(StartRounds(samples, start.vertices, context, &search, &state));
  for (int round = 0; round < options.suzuki_rounds; ++round) {
    context.Report(Stage::kDomainFit, ShareOfRounds(options, round));
    const auto update = [&] {
      SuzukiUpdate(samples, state.feet, options.suzuki_lambda, &state.control_points);
    };
    bool taken = false;
    RILIEVO_RETURN_IF_ERROR(TakeRound(samples, update, 0, context, &search, &state, &taken));
    if (!taken) break;
  }
  if (options.method == FitMethod::kLeastSquares) {
    RILIEVO_RETURN_IF_ERROR(FitLeastSquares(samples, options, context, &search, &state));
  }
  context.Report(Stage::kDomainFit, 1.0);

  DomainFit fit;
  fit.control_mesh = {std::move(state.control_points), start.faces, start.creases, start.corners,
                      start.diagonals};
  fit.rms_before = state.rms.front();
  fit.rms_after = state.rms.back();
  fit.round_rms.assign(state.rms.begin() + 1, state.rms.end());
  fit.rounds = static_cast<int>(fit.round_rms.size());
  fit.converged = fit.rounds > 0 && state.largest_move < kFitLoopDomain.converged_move;
  return fit;
}

}  // namespace rilievo
