// The first bytes of a height layer: how its level is transformed and quantised.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/heights/height_lifting.h"

namespace rilievo {

// What a coefficient stands for: its multiple of the step, drawn towards zero by `draw` / 256 of a
// step ([0]: of 1 and -1, [1]: of larger ones), since small magnitudes are likelier.
struct Dequantizer {
  int32_t step = 1;
  std::array<int, 2> draw = {0, 0};
  int64_t Value(int32_t coefficient) const {
    if (coefficient == 0) return 0;
    const int64_t magnitude = std::abs(int64_t{coefficient});
    const int64_t value = magnitude * step - ((int64_t{step} * draw[magnitude > 1 ? 1 : 0]) >> 8);
    return coefficient < 0 ? -value : value;
  }
};

inline constexpr int32_t kMaxHeightStep = 1 << 24;  // units

// Of a payload's first byte, over rule * 16 + strength.
inline constexpr int kEmptyLayerFlag = 128;

struct HeightLayout {
  LiftingStep lifting;  // level 0: unused
  bool empty = false;   // no coefficients: all zero
  Dequantizer dequantizer;
  std::span<const uint8_t> coded;  // the rest of the payload
};

// Everything but what is coded.
std::vector<uint8_t> WriteHeightLayout(const HeightLayout& layout);

// DATA_LOSS when a field is missing or out of range.
absl::StatusOr<HeightLayout> ReadHeightLayout(std::span<const uint8_t> payload, int level);

// A level whose heights stand in groups (face_groups.h): what they share, an index, and a piece a
// group that decodes by itself.
struct GroupedLayout {
  LiftingStep lifting;
  int32_t step = 1;
  // Empty where a group has neither coefficients nor filled heights.
  std::vector<std::span<const uint8_t>> pieces;
};

// The whole payload.
std::vector<uint8_t> WriteGroupedLayout(const LiftingStep& lifting, int32_t step,
                                        const std::vector<std::vector<uint8_t>>& pieces);

// DATA_LOSS when the index is cut off, out of range, or its checksum is wrong. The pieces are not
// looked at.
absl::StatusOr<GroupedLayout> ReadGroupedLayout(std::span<const uint8_t> payload, int level,
                                                int group_count);

struct PieceLayout {
  bool empty = false;  // no coefficients, flags of filled heights only
  std::array<int, 2> draw = {0, 0};
  std::span<const uint8_t> coded;
};

// Everything but what is coded.
std::vector<uint8_t> WritePieceLayout(const PieceLayout& layout);

// `piece`: not empty. DATA_LOSS when it is cut off or its checksum is wrong.
absl::StatusOr<PieceLayout> ReadPieceLayout(std::span<const uint8_t> piece, int level, int group);

}  // namespace rilievo
