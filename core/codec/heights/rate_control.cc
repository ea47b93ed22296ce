#include "core/codec/heights/rate_control.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/heights/step_search.h"

namespace rilievo {
namespace {

constexpr StepRange kSteps = {1e-8, 0.25};
constexpr double kStepOverError = 4;  // about, at the errors that are worth coding

// What the rounds after the second take off the error.
constexpr double kLaterRounds = 0.995;
// Steps this much apart or nearer are told from each other by the power of the error alone.
constexpr double kNearStep = 1.08;

StepRange StepsFrom(double least_step) {
  const double finest = std::max(kSteps.finest, least_step);
  return {finest, std::max(finest, kSteps.coarsest)};
}

}  // namespace

// The rounds after the first take about the same share off the error at all steps, and two rounds
// tell which. So the first round alone is asked for at further steps, each where the power of the
// error that was seen last meets what is wanted.
absl::StatusOr<double> FindStep(const HeightCoding& encoder, double rms,
                                const RunContext& context) {
  constexpr double kAim = 1 - kCloseStep / 2, kMostFactor = 3;
  constexpr double kLeastPower = 0.3, kMostPower = 1.2;
  constexpr int kMostLooks = 5;
  double step = std::clamp(kStepOverError * rms, kSteps.finest, kSteps.coarsest);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<double> rounds, encoder.RmsOfRounds(step, 2, context));
  if (!(rounds[0] > 0) || !(rounds[1] > 0)) return step;
  const double wanted = kAim * rms / (kLaterRounds * rounds[1] / rounds[0]);  // of a first round
  double error = rounds[0], power = kErrorOverStep;
  for (int look = 0;; ++look) {
    const double factor =
        std::clamp(std::pow(wanted / error, 1 / power), 1 / kMostFactor, kMostFactor);
    const double next = std::clamp(step * factor, kSteps.finest, kSteps.coarsest);
    const bool is_near = next == step || std::max(factor, 1 / factor) < kNearStep;
    if (is_near || look == kMostLooks) return next;
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<double> seen, encoder.RmsOfRounds(next, 1, context));
    if (!(seen[0] > 0)) return step;
    power = std::clamp(std::log(seen[0] / error) / std::log(next / step), kLeastPower, kMostPower);
    step = next;
    error = seen[0];
  }
}

absl::StatusOr<EncodedHeights> EncodeWithinError(const HeightCoding& encoder, double rms,
                                                 double least_step, const RunContext& context) {
  const auto encode = [&](double step) { return encoder.Encode(step, context); };
  double guess = kStepOverError * rms;
  if (guess > least_step) {
    RILIEVO_ASSIGN_OR_RETURN(guess, FindStep(encoder, rms, context));
  }
  StepSearch<EncodedHeights> search(
      encode, [rms](const EncodedHeights& encoded) { return encoded.rms / rms; }, true);
  RILIEVO_RETURN_IF_ERROR(search.Run(guess, StepsFrom(least_step)));
  if (search.best()) return *std::move(search.best());
  return *std::move(search.closest());
}

absl::StatusOr<EncodedHeights> EncodeWithinBytes(const HeightCoding& encoder, int64_t bytes,
                                                 int64_t overhead, double least_step,
                                                 const RunContext& context) {
  const auto encode = [&](double step) { return encoder.Encode(step, context); };
  const auto total = [overhead](const EncodedHeights& encoded) {
    return encoded.bytes() + overhead * static_cast<int64_t>(encoded.layers.size());
  };
  StepSearch<EncodedHeights> search(
      encode,
      [&](const EncodedHeights& encoded) {
        return static_cast<double>(total(encoded)) /
               static_cast<double>(std::max<int64_t>(1, bytes));
      },
      false);
  constexpr double kFirstStep = 1e-3;
  RILIEVO_RETURN_IF_ERROR(search.Run(kFirstStep, StepsFrom(least_step)));
  if (search.best()) return *std::move(search.best());
  RILIEVO_ASSIGN_OR_RETURN(EncodedHeights coarsest, encoder.Encode(kSteps.coarsest, context));
  if (total(coarsest) <= bytes) return coarsest;
  return absl::ResourceExhaustedError(
      absl::StrCat("the coarsest heights take ", total(coarsest), " bytes, ", bytes, " are left"));
}

}  // namespace rilievo
