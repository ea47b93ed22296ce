#include "core/domain/least_squares_fit.h"

#include <algorithm>
#include <vector>

#include "core/base/status_macros.h"
#include "core/domain/fairness.h"
#include "core/domain/gauss_newton.h"
#include "core/domain/sample_targets.h"

namespace rilievo {
namespace {

// Of the progress: what came before.
constexpr double kLeastSquaresBegin = 0.2;
// A round after which the cloud is farther off than this many times the distance before it is
// taken back.
constexpr double kWorse = 1.05;

}  // namespace

absl::Status FitLeastSquares(const DomainSamples& samples, const FitOptions& options,
                             const RunContext& context, FootPointSearch* search, FitState* state) {
  const AreaShares areas = ShareArea(samples, state->surface);
  SampleTargets targets = MakeSampleTargets(samples);
  const GaussNewton gauss_newton(samples, areas);
  double tangential_weight = options.tangential_weight;
  for (int round = 0; round < options.rounds; ++round) {
    context.Report(Stage::kDomainFit,
                   kLeastSquaresBegin + (1 - kLeastSquaresBegin) * round / options.rounds);
    const double fairness =
        FairnessOfRound(options.fairness_start, options.fairness_end, round, options.rounds);
    const std::vector<double> stiffness =
        SliverStiffness(samples, state->control_points, state->surface);
    RILIEVO_RETURN_IF_ERROR(AimSamples(samples, state->surface, state->feet, areas, stiffness,
                                       tangential_weight, context, &targets));
    // Where it was stopped, TakeRound() says so.
    const auto solve = [&] {
      gauss_newton.Step(targets, fairness, context, &state->control_points).IgnoreError();
    };
    bool taken = false;
    RILIEVO_RETURN_IF_ERROR(TakeRound(samples, solve, kWorse, context, search, state, &taken));
    if (!taken) tangential_weight = std::clamp(10 * tangential_weight, 0.1, 1.0);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
