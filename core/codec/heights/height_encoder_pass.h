// What HeightEncoder keeps while it codes.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_encoder.h"
#include "core/codec/heights/height_layout.h"

namespace rilievo {

// One run over all levels.
struct HeightEncoder::Pass {
  double unit = 0;
  double least_unit = 0;                  // a smaller one did not hold the heights
  std::atomic<bool> fits = true;          // no height beyond the range of the format so far
  std::vector<Dequantizer> dequantizers;  // per level
  HeightState state;
  std::vector<int32_t> coefficients;  // as decoded, in units
  std::vector<std::vector<uint8_t>> layers;
  const SharedHeights* shared = nullptr;  // coded elsewhere; null: here
  // Of each group: dequantizer draws and pieces of level kFirstGroupedLevel and on.
  std::vector<std::vector<std::array<int, 2>>> draws;
  std::vector<std::vector<std::vector<uint8_t>>> pieces;
};

}  // namespace rilievo
