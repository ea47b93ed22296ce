// Which heights are smoothed, the payload of chunk `s` (docs/dss-format.md, section 5.6): coded as
// the flags of filled heights are, among the heights that are not filled.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Levels [begin, end). `state.filled` holds the flags; those of vertices `elsewhere` are not coded.
template <typename Coder>
void CodeSmoothedLevels(Coder& coder, const LoopRefinement& refinement, int begin, int end,
                        const std::vector<uint8_t>& elsewhere, HeightModels& models,
                        HeightState& state) {
  NoChoice none;
  for (int level = begin; level < end; ++level) {
    LevelCoder<Coder, NoChoice>(coder, none, refinement, level, 1, true, models, state,
                                elsewhere.data())
        .Run(true);
  }
}

// The flags of the whole at the group's vertices.
std::vector<uint8_t> FlagsOfGroup(const std::vector<uint8_t>& whole,
                                  const std::vector<int>& whole_vertex);

// What a group does not code: what others do, and heights that are filled.
std::vector<uint8_t> NotOfGroup(const GroupMesh& mesh, const std::vector<uint8_t>& filled);

// The flags of a file while its heights are decoded.
class SmoothedReader {
 public:
  // `group_count` 0: the flags of all levels stand together. DATA_LOSS when the index of the groups
  // is damaged.
  static absl::StatusOr<SmoothedReader> Open(std::span<const uint8_t> payload, int group_count);

  // The first `level_count` levels of the whole, all of them or those that groups share. `filled`
  // has been decoded. DATA_LOSS when the bytes end too early.
  absl::Status ReadShared(const LoopRefinement& refinement, int level_count,
                          const std::vector<uint8_t>& filled);
  const std::vector<uint8_t>& shared() const { return state_.filled; }

  // Flags by vertex of the group's mesh at `max_level`. `whole_vertex`: see StateOfGroup; `filled`
  // by vertex of the group's mesh. For several threads at once.
  absl::StatusOr<std::vector<uint8_t>> ReadGroup(const GroupMesh& mesh, int max_level,
                                                 const std::vector<int>& whole_vertex,
                                                 const std::vector<uint8_t>& filled) const;

 private:
  std::span<const uint8_t> shared_;
  std::vector<std::span<const uint8_t>> pieces_;
  HeightModels models_;
  HeightState state_;
};

}  // namespace rilievo
