#include "core/displacement/local_fit/scale_ladder.h"

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

void ScaleLadder::Add(int level, const FitWindow& window) {
  windows[count] = window;
  levels[count++] = level;
}

bool IsOut(const FitWindow& window, const FitWindow& narrower, float noise) {
  return SquaredOff(window, narrower, noise) > kOut * narrower.variance_factor;
}

std::optional<FitWindow> SelectScale(const ScaleLadder& ladder) {
  if (ladder.count == 0) return std::nullopt;
  FitWindow fit = ladder.windows[0];
  for (int i = 1; i < ladder.count; ++i) {
    const FitWindow& window = ladder.windows[i];
    const float doubt = SquaredOff(window, fit, ladder.noise) / (kAgreement * fit.variance_factor);
    if (doubt >= 1) break;
    const float blend = 1 - doubt;
    fit.height += blend * (window.height - fit.height);
    fit.slope_u += blend * (window.slope_u - fit.slope_u);
    fit.slope_v += blend * (window.slope_v - fit.slope_v);
    fit.variance_factor += blend * (window.variance_factor - fit.variance_factor);
  }
  return fit;
}

}  // namespace rilievo
