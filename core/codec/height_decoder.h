// The height layers of format version 2 back to heights.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/refinement.h"

namespace rilievo {

struct DecodedHeights {
  std::vector<int32_t> heights;  // in units, one per vertex of the level of the last layer
  std::vector<uint8_t> filled;   // same
};

// `layers`: payloads of level 0, 1, ..., at least one; `refinement` reaches the last level but one.
// DATA_LOSS when the bytes hold fewer heights, or numbers beyond the range of the format. The
// caller has checked the counts against the bytes.
absl::StatusOr<DecodedHeights> DecodeHeightLayers(
    const std::vector<std::span<const uint8_t>>& layers, const LoopRefinement& refinement,
    bool has_filled, const RunContext& context);

}  // namespace rilievo
