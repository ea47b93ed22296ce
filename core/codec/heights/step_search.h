// The quantiser step at which what is coded keeps a bound.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/status_macros.h"

namespace rilievo {

struct StepRange {
  double finest = 0, coarsest = 0;
};

// How near to the bound a search ends, as a share of it.
inline constexpr double kCloseStep = 0.03;
// Exponent of the error over the step, about.
inline constexpr double kErrorOverStep = 0.85;

// Search over log(step) for measure(step) = 1, where it is about a power of the step: the chord of
// the bracket in logarithms is the next guess.
template <typename Encoded>
class StepSearch {
 public:
  using Encode = std::function<absl::StatusOr<Encoded>(double step)>;
  using Measure = std::function<double(const Encoded&)>;

  // `encode` gives what is coded with a step. `measure`: of that, rising with the step if `rising`.
  // Allowed is at most 1.
  StepSearch(Encode encode, Measure measure, bool rising)
      : encode_(std::move(encode)), measure_(std::move(measure)), rising_(rising) {}

  // Ends when what is measured is within kCloseStep of 1, or after a dozen trials. The errors of
  // `encode` are the only ones.
  absl::Status Run(double guess, const StepRange& range) {
    low_.step = range.finest;
    high_.step = range.coarsest;
    double step = std::clamp(guess, low_.step, high_.step);
    for (int trial = 0; trial < kMostTrials; ++trial) {
      RILIEVO_ASSIGN_OR_RETURN(Encoded encoded, encode_(step));
      const double value = measure_(encoded);
      const bool allowed = value <= 1;
      if (!Keep(std::move(encoded), value) || (allowed && value >= 1 - kCloseStep)) break;
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

  // Of those allowed, where most of what is allowed is used.
  std::optional<Encoded>& best() { return best_; }
  // Where none is: the last one that came much nearer.
  std::optional<Encoded>& closest() { return closest_; }

 private:
  struct End {
    double step = 0, log_value = 0;
    bool tried = false;
  };

  // Aims at the middle of what is close enough, and keeps away from the bracket's ends.
  double Next(double step, double log_value, bool grow) const {
    constexpr double kAim = -kCloseStep / 2;
    if (!low_.tried || !high_.tried) {
      constexpr double kLeastFactor = 1.02, kMostFactor = 3;
      const double way = (kAim - log_value) / (rising_ ? kErrorOverStep : kBytesOverStep);
      const double factor = std::clamp(std::exp(std::abs(way)), kLeastFactor, kMostFactor);
      return std::clamp(grow ? step * factor : step / factor, low_.step, high_.step);
    }
    const double rise = high_.log_value - low_.log_value;
    const double part = rise != 0 ? std::clamp((kAim - low_.log_value) / rise, 0.1, 0.9) : 0.5;
    return low_.step * std::pow(high_.step / low_.step, part);
  }

  // False when a finer step has not helped: none will be allowed then.
  bool Keep(Encoded encoded, double value) {
    if (value <= 1) {
      if (!best_ || value > best_value_) {
        best_ = std::move(encoded);
        best_value_ = value;
      }
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

  static constexpr double kNarrow = 1.01;  // bracket that is not divided further
  // Of the error over the step: a finer one does not help.
  static constexpr double kStuckPower = 0.05;
  static constexpr int kMostTrials = 12;
  // Exponent of bytes over the step, about, for the guesses before there is a bracket.
  static constexpr double kBytesOverStep = -0.7;

  Encode encode_;
  Measure measure_;
  bool rising_;
  End low_, high_;
  std::optional<Encoded> best_, closest_;
  double best_value_ = 0, closest_value_ = 0;
};

}  // namespace rilievo
