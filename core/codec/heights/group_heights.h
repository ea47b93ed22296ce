// The heights of one group of control faces, from its pieces alone.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/mesh/face_groups.h"

namespace rilievo {

// What the levels below kFirstGroupedLevel, which all groups share, leave at a group's vertices.
// `whole_vertex`: of each of its vertices of level kFirstGroupedLevel - 1, the number in the whole.
HeightState StateOfGroup(const HeightState& whole, const std::vector<int>& members,
                         const std::vector<int>& whole_vertex);

// HeightState::active after a level that has no coefficients.
std::vector<std::vector<uint8_t>> NoneActive(const LoopRefinement& refinement, int level);

struct GroupHeights {
  std::vector<int32_t> values;  // of coefficients, in units, by vertex of the group's mesh; those
                                // of the shared levels are zero
  std::vector<uint8_t> filled;  // same
};

// `levels`: the layouts of level kFirstGroupedLevel and on; the group's mesh has as many levels.
// `state` is what StateOfGroup gives, `models` as the shared levels have left them. DATA_LOSS for a
// piece that is damaged or says numbers beyond the range of the format.
absl::StatusOr<GroupHeights> DecodeGroup(const GroupMesh& mesh,
                                         const std::vector<GroupedLayout>& levels, bool has_filled,
                                         HeightModels models, HeightState state);

}  // namespace rilievo
