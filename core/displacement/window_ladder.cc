#include "core/displacement/window_ladder.h"

#include <algorithm>

namespace rilievo {
namespace {

// Squared difference to the narrower windows, in variances of theirs, at which a wider window is
// given up; below, it is blended in.
constexpr float kAgreement = 6.0f;
// And at which the difference is that of two surfaces.
constexpr float kOut = 25.0f;

float SquaredOff(const FitWindow& window, const FitWindow& narrower, float noise) {
  const float off = (window.height - narrower.height) / noise;
  return off * off;
}

}  // namespace

void WindowLadder::Add(int rung, const FitWindow& window) {
  windows[count] = window;
  rungs[count++] = rung;
}

bool IsOut(const FitWindow& window, const FitWindow& narrower, float noise) {
  return SquaredOff(window, narrower, noise) > kOut * narrower.variance_factor;
}

LadderTrust::LadderTrust(std::span<const WindowLadder> region) {
  constexpr int kFewest = 32;         // differences that say anything
  constexpr double kTolerance = 1.5;  // of the ratio found, which is that of few and alike
  // The noise told to the fits may itself be detail in part: doubt grows faster than the ratio.
  constexpr double kSteepness = 4;
  std::array<double, WindowLadder::kMostRungs> found{}, expected{};
  std::array<int, WindowLadder::kMostRungs> pairs{};
  for (const WindowLadder& ladder : region) {
    for (int i = 1; i < ladder.count; ++i) {
      const FitWindow &narrow = ladder.windows[i - 1], &wide = ladder.windows[i];
      if (IsOut(wide, narrow, ladder.noise)) continue;
      found[ladder.rungs[i]] += SquaredOff(wide, narrow, ladder.noise);
      expected[ladder.rungs[i]] += narrow.variance_factor - wide.variance_factor;
      ++pairs[ladder.rungs[i]];
    }
  }
  for (int rung = 0; rung < WindowLadder::kMostRungs; ++rung) {
    if (pairs[rung] < kFewest || !(expected[rung] > 0)) continue;
    const double excess = kSteepness * std::max(0.0, found[rung] / expected[rung] - kTolerance);
    weights_[rung] = static_cast<float>(1 / (1 + excess * excess));
  }
}

std::optional<FitWindow> Climb(const WindowLadder& ladder, const LadderTrust& trust) {
  if (ladder.count == 0) return std::nullopt;
  FitWindow fit = ladder.windows[0];
  for (int i = 1; i < ladder.count; ++i) {
    const FitWindow& window = ladder.windows[i];
    const float doubt = SquaredOff(window, fit, ladder.noise) / (kAgreement * fit.variance_factor);
    if (doubt >= 1) break;
    const float blend = (1 - doubt) * trust.of(ladder.rungs[i]);
    fit.height += blend * (window.height - fit.height);
    fit.slope_u += blend * (window.slope_u - fit.slope_u);
    fit.slope_v += blend * (window.slope_v - fit.slope_v);
    fit.variance_factor += blend * (window.variance_factor - fit.variance_factor);
  }
  return fit;
}

}  // namespace rilievo
