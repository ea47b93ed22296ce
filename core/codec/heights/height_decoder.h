// The height layers of a file back to heights.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/heights/smoothed_flags.h"
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

inline constexpr int kHeightReach = 4;

// The heights of parts of a surface with groups and at least kFirstGroupedLevel + 1 layers: what
// all groups share is decoded once.
class PartHeights {
 public:
  // As above; `shared` has the control mesh at least. It, the groups and the bytes are kept by
  // reference. The errors of DecodeHeightLayers().
  static absl::StatusOr<PartHeights> Open(const std::vector<std::span<const uint8_t>>& layers,
                                          const LoopRefinement& shared, const FaceGroups& groups,
                                          bool has_filled,
                                          const std::optional<std::span<const uint8_t>>& smoothed,
                                          const RunContext& context);

  // `part`: control faces, whose connectivity alone `refinement` refines. Heights come out as those
  // of the whole wherever all faces within kHeightReach rings are in the part. Reads the pieces of
  // groups with a face in the part. For several threads at once.
  absl::StatusOr<DecodedHeights> Decode(const std::vector<int>& part,
                                        const LoopRefinement& refinement,
                                        const RunContext& context) const;

 private:
  PartHeights(const MeshTopology& control, const FaceGroups& groups, bool has_filled)
      : control_(control), groups_(groups), has_filled_(has_filled) {}

  const MeshTopology& control_;
  const FaceGroups& groups_;
  bool has_filled_;
  HeightState state_;  // after the shared levels
  std::unique_ptr<HeightModels> models_ = std::make_unique<HeightModels>();
  std::unique_ptr<SmoothedReader> flags_;  // null: not said
  std::vector<GroupedLayout> levels_;
};

}  // namespace rilievo
