#include "core/codec/heights/group_heights.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/height_range.h"

namespace rilievo {
HeightState StateOfGroup(const HeightState& whole, const std::vector<int>& members,
                         const std::vector<int>& whole_vertex) {
  HeightState state;
  for (int v : whole_vertex) {
    state.heights.push_back(whole.heights[v]);
    state.coefficients.push_back(whole.coefficients[v]);
    state.filled.push_back(whole.filled[v]);
  }
  for (const std::vector<uint8_t>& of_level : whole.active) {
    std::vector<uint8_t>& active = state.active.emplace_back();
    for (int f : members) active.push_back(of_level[f]);
  }
  return state;
}

std::vector<std::vector<uint8_t>> NoneActive(const LoopRefinement& refinement, int level) {
  std::vector<std::vector<uint8_t>> active;
  for (int j = 0; j < level - 1; ++j) {
    active.emplace_back(refinement.levels[j].face_count(), 0);
  }
  return active;
}

absl::StatusOr<GroupHeights> DecodeGroup(const GroupMesh& mesh,
                                         const std::vector<GroupedLayout>& levels, bool has_filled,
                                         HeightModels models, HeightState state) {
  NoChoice chooser;
  GroupHeights decoded;
  decoded.values.assign(state.heights.size(), 0);
  for (size_t i = 0; i < levels.size(); ++i) {
    const int level = kFirstGroupedLevel + static_cast<int>(i);
    const size_t count = mesh.refinement.vertex_count(level);
    const std::span<const uint8_t> piece = levels[i].pieces[mesh.group];
    Dequantizer dequantizer{levels[i].step, {0, 0}};
    if (piece.empty()) {
      state.coefficients.resize(count, 0);
      state.filled.resize(count, 0);
      state.active = NoneActive(mesh.refinement, level);
    } else {
      RILIEVO_ASSIGN_OR_RETURN(const PieceLayout layout, ReadPieceLayout(piece, level, mesh.group));
      dequantizer.draw = layout.draw;
      RangeDecoder coder(layout.coded);
      LevelCoder<RangeDecoder, NoChoice> coded(coder, chooser, mesh.refinement, level,
                                               levels[i].step, has_filled, models, state,
                                               mesh.foreign.data());
      if (!coded.Run(layout.empty)) return HeightOutOfRange();
      if (coder.overrun()) {
        return absl::DataLossError(absl::StrCat("the heights of group ", mesh.group, " of level ",
                                                level, " end before their last one"));
      }
    }
    const auto known = static_cast<std::ptrdiff_t>(decoded.values.size());
    if (!AddValues(dequantizer, state.coefficients, decoded.values)) return HeightOutOfRange();
    state.heights.insert(state.heights.end(), decoded.values.begin() + known, decoded.values.end());
    if (i + 1 == levels.size()) break;
    SynthesizeLevel(mesh.refinement.levels[level - 1], levels[i].lifting, state.heights);
    if (!InHeightRange(state.heights)) return HeightOutOfRange();
  }
  decoded.filled = std::move(state.filled);
  return decoded;
}

}  // namespace rilievo
