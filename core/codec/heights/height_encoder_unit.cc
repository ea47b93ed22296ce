#include "core/codec/heights/height_encoder_unit.h"

#include <algorithm>
#include <cmath>

#include "core/codec/bytes/stored_step.h"
#include "core/codec/heights/height_range.h"

namespace rilievo {
namespace {

// Units per step of the level with the smallest step, at least: integers round finer than that.
constexpr int kUnitsPerStep = 32;
// Heights take at most this share of the decoder's range.
constexpr double kRangeShare = 0.25;
// How much wider the unit becomes where heights do not fit: each time costs a pass.
constexpr double kWidening = 4;

}  // namespace

double UnitOfHeights(const std::vector<double>& steps, double highest, double largest_target,
                     double least) {
  const double wanted = *std::min_element(steps.begin(), steps.end()) / kUnitsPerStep;
  return StoredStep(std::max({wanted, highest / (kRangeShare * kMaxHeightUnits),
                              largest_target / kMaxHeightUnits, least}));
}

std::vector<double> StepsOfLevels(double step, const std::vector<double>& level_gains) {
  const double finest = level_gains.back();
  std::vector<double> steps;
  for (const double gain : level_gains) {
    steps.push_back(gain > 0 && finest > 0 ? step * std::sqrt(finest / gain) : step);
  }
  return steps;
}

int32_t StepInUnits(double step, double unit) {
  return static_cast<int32_t>(std::clamp(std::round(step / unit), 1.0, double{kMaxHeightStep}));
}

double WiderUnit(double unit) { return kWidening * unit; }

}  // namespace rilievo
