#include "core/codec/height_decoder.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/height_coder.h"
#include "core/codec/height_layout.h"
#include "core/codec/range_coder.h"

namespace rilievo {
namespace {

bool InRange(std::span<const int32_t> values) {
  return std::all_of(values.begin(), values.end(), [](int32_t value) {
    return value >= -kMaxHeightUnits && value <= kMaxHeightUnits;
  });
}

// Coefficients of the level as numbers behind those of the levels before.
bool Dequantize(const Dequantizer& dequantizer, const std::vector<int32_t>& coefficients,
                std::vector<int32_t>& values) {
  values.reserve(coefficients.size());
  for (size_t v = values.size(); v < coefficients.size(); ++v) {
    const int64_t value = dequantizer.Value(coefficients[v]);
    if (value < -kMaxHeightUnits || value > kMaxHeightUnits) return false;
    values.push_back(static_cast<int32_t>(value));
  }
  return true;
}

}  // namespace

absl::StatusOr<DecodedHeights> DecodeHeightLayers(
    const std::vector<std::span<const uint8_t>>& layers, const LoopRefinement& refinement,
    bool has_filled, const RunContext& context) {
  HeightState state;
  HeightModels models;
  NoChoice chooser;
  for (int level = 0; level < static_cast<int>(layers.size()); ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const HeightLayout layout, ReadHeightLayout(layers[level], level));
    RangeDecoder coder(layout.coded);
    LevelCoder<RangeDecoder, NoChoice> coded(coder, chooser, refinement, level,
                                             layout.dequantizer.step, has_filled, models, state);
    if (!coded.Run(layout.empty) ||
        !Dequantize(layout.dequantizer, state.coefficients, state.heights)) {
      return absl::DataLossError("a height lies outside the range of the format");
    }
    if (coder.overrun()) {
      return absl::DataLossError(
          absl::StrCat("the heights of level ", level, " end before their last one"));
    }
    if (level > 0) {
      SynthesizeLevel(refinement.levels[level - 1], layout.lifting, state.heights);
      if (!InRange(state.heights)) {
        return absl::DataLossError("a height lies outside the range of the format");
      }
    }
  }
  return DecodedHeights{std::move(state.heights), std::move(state.filled)};
}

}  // namespace rilievo
