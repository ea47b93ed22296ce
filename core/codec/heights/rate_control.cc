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

namespace rilievo {
namespace {

constexpr double kCoarsestStep = 0.25, kFinestStep = 1e-8;
constexpr double kClose = 0.03;
constexpr double kNarrow = 1.01;      // bracket that is not divided further
constexpr double kStuckPower = 0.05;  // of the error over the step: a finer one does not help
constexpr int kMostTrials = 12;

// Exponents of error and bytes over the step, about, for the guesses before there is a bracket.
constexpr double kErrorPower = 0.85, kBytesPower = -0.7;
constexpr double kStepOverError = 4;  // about, at the errors that are worth coding

// What the rounds after the second take off the error.
constexpr double kLaterRounds = 0.995;
// Steps this much apart or nearer are told from each other by the power of the error alone.
constexpr double kNearStep = 1.08;

// Search over log(step) for measure(step) = 1, where it is about a power of the step: the chord of
// the bracket in logarithms is the next guess.
class StepSearch {
 public:
  // `measure`: of an encoding, rising with the step if `rising`. Allowed is at most 1.
  StepSearch(const HeightEncoder& encoder, std::function<double(const EncodedHeights&)> measure,
             bool rising)
      : encoder_(encoder), measure_(std::move(measure)), rising_(rising) {}

  absl::Status Run(double guess, double least_step, const RunContext& context) {
    low_.step = std::max(kFinestStep, least_step);
    high_.step = std::max(low_.step, kCoarsestStep);
    double step = std::clamp(guess, low_.step, high_.step);
    for (int trial = 0; trial < kMostTrials; ++trial) {
      RILIEVO_ASSIGN_OR_RETURN(EncodedHeights encoded, encoder_.Encode(step, context));
      const double value = measure_(encoded);
      const bool allowed = value <= 1;
      if (!Keep(std::move(encoded), value) || (allowed && value >= 1 - kClose)) break;
      // Too small an error, or too many bytes: the step has to grow; else to shrink.
      const bool grow = allowed == rising_;
      if (step == (grow ? high_.step : low_.step)) break;
      const double log_value = std::log(std::max(value, 1e-12));
      (grow ? low_ : high_) = {step, log_value, true};
      if (high_.step < kNarrow * low_.step) break;
      step = Next(step, log_value, grow);
    }
    return absl::OkStatus();
  }

  // Of those allowed.
  std::optional<EncodedHeights>& best() { return best_; }
  // Where none is: the last one that came much nearer.
  std::optional<EncodedHeights>& closest() { return closest_; }

 private:
  struct End {
    double step = 0, log_value = 0;
    bool tried = false;
  };

  // Aims at the middle of what is close enough, and keeps away from the bracket's ends.
  double Next(double step, double log_value, bool grow) const {
    constexpr double kAim = -kClose / 2;
    if (!low_.tried || !high_.tried) {
      constexpr double kLeastFactor = 1.02, kMostFactor = 3;
      const double way = (kAim - log_value) / (rising_ ? kErrorPower : kBytesPower);
      const double factor = std::clamp(std::exp(std::abs(way)), kLeastFactor, kMostFactor);
      return std::clamp(grow ? step * factor : step / factor, low_.step, high_.step);
    }
    const double rise = high_.log_value - low_.log_value;
    const double part = rise != 0 ? std::clamp((kAim - low_.log_value) / rise, 0.1, 0.9) : 0.5;
    return low_.step * std::pow(high_.step / low_.step, part);
  }

  // False when a finer step has not helped: none will be allowed then.
  bool Keep(EncodedHeights encoded, double value) {
    if (value <= 1) {
      const bool better =
          !best_ || (rising_ ? encoded.step > best_->step : encoded.step < best_->step);
      if (better) best_ = std::move(encoded);
      return true;
    }
    if (!rising_ || best_) return true;
    if (closest_ && value > closest_value_ * std::pow(encoded.step / closest_->step, kStuckPower)) {
      return false;
    }
    closest_ = std::move(encoded);
    closest_value_ = value;
    return true;
  }

  const HeightEncoder& encoder_;
  std::function<double(const EncodedHeights&)> measure_;
  bool rising_;
  End low_, high_;
  std::optional<EncodedHeights> best_, closest_;
  double closest_value_ = 0;
};

}  // namespace

// The rounds after the first take the same share off the error at all steps nearby, and two rounds
// tell which. The usual first step where the error is no such power of the step.
absl::StatusOr<double> FindStep(const HeightEncoder& encoder, double rms,
                                const RunContext& context) {
  constexpr double kAim = 1 - kClose / 2, kMostFactor = 3;
  constexpr double kLeastPower = 0.6, kMostPower = 1.2;
  const double first = std::clamp(kStepOverError * rms, kFinestStep, kCoarsestStep);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<double> rounds,
                           encoder.RmsOfRounds(first, 2, context));
  if (!(rounds[0] > 0) || !(rounds[1] > 0)) return first;
  const double wanted = kAim * rms / (kLaterRounds * rounds[1] / rounds[0]);  // of a first round
  const double factor = std::pow(wanted / rounds[0], 1 / kErrorPower);
  if (!(std::max(factor, 1 / factor) < kMostFactor)) return first;
  const double second = std::clamp(first * factor, kFinestStep, kCoarsestStep);
  if (std::max(factor, 1 / factor) < kNearStep) return second;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<double> error,
                           encoder.RmsOfRounds(second, 1, context));
  const double power = std::log(error[0] / rounds[0]) / std::log(second / first);
  if (!(power >= kLeastPower && power <= kMostPower)) return first;
  return std::clamp(second * std::pow(wanted / error[0], 1 / power), kFinestStep, kCoarsestStep);
}

absl::StatusOr<EncodedHeights> EncodeWithinError(const HeightEncoder& encoder, double rms,
                                                 double least_step, const RunContext& context) {
  double guess = kStepOverError * rms;
  if (guess > least_step) {
    RILIEVO_ASSIGN_OR_RETURN(guess, FindStep(encoder, rms, context));
  }
  StepSearch search(
      encoder, [rms](const EncodedHeights& encoded) { return encoded.rms / rms; }, true);
  RILIEVO_RETURN_IF_ERROR(search.Run(guess, least_step, context));
  if (search.best()) return *std::move(search.best());
  return *std::move(search.closest());
}

absl::StatusOr<EncodedHeights> EncodeWithinBytes(const HeightEncoder& encoder, int64_t bytes,
                                                 int64_t overhead, double least_step,
                                                 const RunContext& context) {
  const auto total = [overhead](const EncodedHeights& encoded) {
    return encoded.bytes() + overhead * static_cast<int64_t>(encoded.layers.size());
  };
  StepSearch search(
      encoder,
      [&](const EncodedHeights& encoded) {
        return static_cast<double>(total(encoded)) /
               static_cast<double>(std::max<int64_t>(1, bytes));
      },
      false);
  constexpr double kFirstStep = 1e-3;
  RILIEVO_RETURN_IF_ERROR(search.Run(kFirstStep, least_step, context));
  if (search.best()) return *std::move(search.best());
  RILIEVO_ASSIGN_OR_RETURN(EncodedHeights coarsest, encoder.Encode(kCoarsestStep, context));
  if (total(coarsest) <= bytes) return coarsest;
  return absl::ResourceExhaustedError(
      absl::StrCat("the coarsest heights take ", total(coarsest), " bytes, ", bytes, " are left"));
}

}  // namespace rilievo
