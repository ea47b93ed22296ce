#include "core/domain/least_squares_fit.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/domain/fairness.h"
#include "core/domain/fit_energy.h"
#include "core/domain/minimize_energy.h"
#include "core/domain/sample_targets.h"
#include "core/domain/settings.h"

namespace rilievo {

absl::Status FitLeastSquares(const DomainSamples& samples, const FitOptions& options,
                             const RunContext& context, FootPointSearch* search, FitState* state) {
  const AreaShares areas = ShareArea(samples, state->surface);
  SampleTargets targets = MakeSampleTargets(samples);
  RILIEVO_ASSIGN_OR_RETURN(
      std::vector<double> weights,
      FairnessWeights(search->cloud(), search->index(), state->surface, areas, context));
  RILIEVO_ASSIGN_OR_RETURN(FitEnergy energy,
                           FitEnergy::Build(samples, std::move(weights), targets, context));
  double tangential_weight = options.tangential_weight;
  for (int round = 0; round < options.rounds; ++round) {
    context.Report(Stage::kDomainFit, ShareOfRounds(options, options.suzuki_rounds + round));
    energy.set_fairness(
        FairnessOfRound(options.fairness_start, options.fairness_end, round, options.rounds));
    RILIEVO_RETURN_IF_ERROR(AimSamples(samples, state->surface, state->feet, areas,
                                       tangential_weight, context, &targets));
    const auto solve = [&] { MinimizeEnergy(energy, context, &state->control_points); };
    bool taken = false;
    RILIEVO_RETURN_IF_ERROR(
        TakeRound(samples, solve, kLeastSquaresFit.worse, context, search, state, &taken));
    if (!taken) tangential_weight = std::clamp(10 * tangential_weight, 0.1, 1.0);
    if (options.wanted_rms > 0 && taken &&
        state->rms.back() > kLeastSquaresFit.out_of_reach * options.wanted_rms) {
      break;
    }
  }
  return absl::OkStatus();
}

}  // namespace rilievo
