// One level of the whole surface to bytes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_encoder_draw.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/heights/height_range.h"
#include "core/codec/heights/rate_distortion_chooser.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Bits are worth this many squared steps. At high rates an error of step^2 / 12 falls by
// step^2 ln 2 / 6 = 0.1155 step^2 with one more bit.
inline constexpr double kLambda = 0.11;

// What a level's coefficients are chosen from. Entries by vertex; targets in units.
struct LevelTargets {
  const std::vector<double>& targets;
  const std::vector<double>& gains;
  double mean_gain;
};

// Appends to `state` and to the values of `coefficients`, in units; `payload` becomes that of the
// chunk. The draw of `dequantizer`, with which coefficients are chosen, becomes the one that fits
// them best. False when heights or coefficients lie outside the range of the format.
template <typename Coder>
bool CodeLevelOfWhole(const LoopRefinement& refinement, int level, const LiftingStep& lifting,
                      const LevelTargets& told, bool has_filled, Dequantizer& dequantizer,
                      HeightModels& models, HeightState& state, std::vector<int32_t>& coefficients,
                      std::vector<uint8_t>* payload) {
  const int begin = level == 0 ? 0 : refinement.vertex_count(level - 1);
  const int end = refinement.vertex_count(level);
  Coder coder;
  RateDistortionChooser chooser(refinement, level, dequantizer, kLambda, told.targets, told.gains,
                                told.mean_gain);
  LevelCoder<Coder, RateDistortionChooser> coded(coder, chooser, refinement, level,
                                                 dequantizer.step, has_filled, models, state);
  HeightLayout layout;
  layout.empty = chooser.Empty(begin, end);
  const bool coefficients_fit = coded.Run(layout.empty);
  dequantizer.draw = MeanDraw(told.targets, state.coefficients, begin, end, dequantizer.step);
  layout.dequantizer = dequantizer;
  layout.lifting = level > 0 ? lifting : LiftingStep{0, 0};
  *payload = WriteHeightLayout(layout);
  const std::vector<uint8_t> bits = coder.Finish();
  payload->insert(payload->end(), bits.begin(), bits.end());
  std::vector<int32_t>& heights = state.heights;
  if (!coefficients_fit || !AddValues(dequantizer, state.coefficients, heights)) return false;
  coefficients.insert(coefficients.end(), heights.begin() + begin, heights.end());
  if (level > 0) SynthesizeLevel(refinement.levels[level - 1], layout.lifting, heights);
  return InHeightRange(heights);
}

}  // namespace rilievo
