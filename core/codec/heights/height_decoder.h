// The height layers of a file back to heights.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/refinement.h"
#include "core/surface/height_source.h"

namespace rilievo {

struct DecodedHeights {
  std::vector<int32_t> heights;   // in units, one per vertex of the level of the last layer
  std::vector<uint8_t> filled;    // same
  std::vector<uint8_t> smoothed;  // same, where the file says it; else empty

  // `all_smoothed`: those that are not filled.
  std::vector<HeightSource> Sources(bool all_smoothed) const;
};

// `layers`: payloads of level 0, 1, ..., at least one; `refinement` reaches the last level but one.
// `plain`: rules of the levels after these, which have no coefficients, and whose new vertices are
// filled where both ends of their edges are; none where there are groups; the refinement reaches
// the last of them but one. `groups`: of the control faces where the file has them, else null.
// `smoothed`: payload of the
// chunk, where the file has one. DATA_LOSS when the bytes hold
// fewer heights, or numbers beyond the range of the format. The caller has checked the counts
// against the bytes.
absl::StatusOr<DecodedHeights> DecodeHeightLayers(
    const std::vector<std::span<const uint8_t>>& layers, std::span<const uint8_t> plain,
    const LoopRefinement& refinement, const FaceGroups* groups, bool has_filled,
    const std::optional<std::span<const uint8_t>>& smoothed, const RunContext& context);

// The same for a part of a surface with groups and at least kFirstGroupedLevel + 1 layers. `part`:
// control faces of `control`, whose connectivity alone `refinement` refines. Heights come out as
// those of the whole wherever all faces within kHeightReach rings are in the part. Reads the shared
// levels, the indices, and the pieces of groups with a face in the part.
inline constexpr int kHeightReach = 4;
absl::StatusOr<DecodedHeights> DecodePartOfHeights(
    const std::vector<std::span<const uint8_t>>& layers, const LoopRefinement& shared,
    const FaceGroups& groups, const std::vector<int>& part, const LoopRefinement& refinement,
    bool has_filled, const std::optional<std::span<const uint8_t>>& smoothed,
    const RunContext& context);

}  // namespace rilievo
