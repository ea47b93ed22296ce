#include "core/codec/rate_control.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr double kCoarsestStep = 0.25, kFinestStep = 1e-8;
constexpr double kClose = 0.03;
constexpr int kMostTrials = 12;

// Search over log(step) for measure(step) = 1, where it is about a power of the step: bisection,
// with the chord of the bracket in logarithms as the guess.
class StepSearch {
 public:
  // `measure`: of an encoding, rising with the step if `rising`. Kept are encodings on the allowed
  // side: at most 1.
  StepSearch(const HeightEncoder& encoder, std::function<double(const EncodedHeights&)> measure,
             bool rising)
      : encoder_(encoder), measure_(std::move(measure)), rising_(rising) {}

  absl::Status Run(double guess, double least_step, const RunContext& context) {
    double low = std::max(kFinestStep, least_step), high = std::max(low, kCoarsestStep);
    double low_value = 0, high_value = 0;  // log of the measure, known once tried
    bool low_known = false, high_known = false;
    double step = std::clamp(guess, low, high);
    for (int trial = 0; trial < kMostTrials; ++trial) {
      RILIEVO_ASSIGN_OR_RETURN(EncodedHeights encoded, encoder_.Encode(step, context));
      const double value = measure_(encoded);
      const bool allowed = value <= 1;
      if (allowed) Keep(std::move(encoded));
      if (allowed && value >= 1 - kClose) break;
      // Too small an error, or too many bytes: the step has to grow; else to shrink.
      const bool grow = allowed == rising_;
      if ((grow && step >= high) || (!grow && step <= low)) break;
      (grow ? low : high) = step;
      (grow ? low_value : high_value) = std::log(std::max(value, 1e-12));
      (grow ? low_known : high_known) = true;
      if (std::log(high / low) < 0.01) break;
      step = Next(low, low_value, low_known, high, high_value, high_known, step, grow);
    }
    return absl::OkStatus();
  }

  std::optional<EncodedHeights>& best() { return best_; }

 private:
  // The chord aims at the middle of what is close enough, and keeps away from the bracket's ends.
  double Next(double low, double low_value, bool low_known, double high, double high_value,
              bool high_known, double step, bool grow) const {
    if (!low_known || !high_known) {
      const double factor = 3;
      return std::clamp(grow ? step * factor : step / factor, low, high);
    }
    const double span = std::log(high / low), aim = -kClose / 2;
    double part = high_value != low_value ? (aim - low_value) / (high_value - low_value) : 0.5;
    part = std::clamp(part, 0.1, 0.9);
    return low * std::exp(part * span);
  }

  void Keep(EncodedHeights encoded) {
    const bool better =
        !best_ || (rising_ ? encoded.step > best_->step : encoded.step < best_->step);
    if (better) best_ = std::move(encoded);
  }

  const HeightEncoder& encoder_;
  std::function<double(const EncodedHeights&)> measure_;
  bool rising_;
  std::optional<EncodedHeights> best_;
};

}  // namespace

absl::StatusOr<EncodedHeights> EncodeWithinError(const HeightEncoder& encoder, double rms,
                                                 double least_step, const RunContext& context) {
  StepSearch search(
      encoder, [rms](const EncodedHeights& encoded) { return encoded.rms / rms; }, true);
  RILIEVO_RETURN_IF_ERROR(search.Run(10 * rms, least_step, context));
  if (search.best()) return *std::move(search.best());
  return encoder.Encode(std::max(kFinestStep, least_step), context);
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
