// Which heights are smoothed, as a file tells it: a chunk, or a word where all are alike.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/refinement.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// The payload of chunk `s`. Flags by vertex of level `max_level`, those of filled heights 0;
// `refinement` reaches max(0, max_level - 1). `groups`: of the control faces where the file has
// them, else null. CANCELLED is the only error.
absl::StatusOr<std::vector<uint8_t>> EncodeSmoothed(const LoopRefinement& refinement, int max_level,
                                                    const FaceGroups* groups,
                                                    const std::vector<uint8_t>& filled,
                                                    const std::vector<uint8_t>& smoothed,
                                                    const RunContext& context);

// How the file tells which heights are smoothed.
struct EncodedFlags {
  bool all = false;            // that are not filled
  std::vector<uint8_t> chunk;  // empty: none are, or all
};

// What a file would say if patches of fewer than so many vertices had the flag around them.
struct FlagsOfPatches {
  bool any = false, all = false;  // are smoothed
  std::vector<uint8_t> payload;   // where some are
};
// Of how many vertices each is told by the scan; the rest is filled.
struct SourceCounts {
  int64_t smoothed = 0, measured = 0, known = 0;
};
// The largest patches that EncodeSmoothedFlags() needs, with the bytes it has.
absl::StatusOr<EncodedFlags> ChooseSmoothedFlags(
    const SourceCounts& counts, int smallest, int64_t bytes, int64_t most,
    const std::function<absl::StatusOr<FlagsOfPatches>(int patch)>& flags_of);

// Flags of heights that are not measured, as the file tells them: those in small holes, whose
// filled heights count as what is around them, with the smoothed ones.
std::vector<uint8_t> NotMeasured(const std::vector<HeightSource>& sources,
                                 const std::vector<uint8_t>& filled);

// One piece of the groups' payload, empty where the group has no smoothed height to code.
// `members`: of the group, in the mesh that `numbers` and the flags are of; `shared`: as the levels
// that all groups share have left them.
std::vector<uint8_t> EncodeSmoothedOfGroup(const GroupMesh& mesh, const FaceVertices& numbers,
                                           const std::vector<int>& members, int max_level,
                                           const std::vector<uint8_t>& filled,
                                           const std::vector<uint8_t>& smoothed,
                                           const HeightModels& shared);

// `filled`: as the file tells it. Small patches of either kind take on the flag around them: those
// of fewer than `smallest` vertices, and larger ones as long as the chunk takes more than a 32nd of
// `bytes`, which are those of the whole file, about. Where even that makes it more than an eighth
// of them, or more than `most`, all heights have the flag of most.
absl::StatusOr<EncodedFlags> EncodeSmoothedFlags(const DisplacedSurface& surface,
                                                 const LoopRefinement& refinement,
                                                 const std::vector<uint8_t>& filled,
                                                 const FaceGroups* groups, int smallest,
                                                 int64_t bytes, int64_t most,
                                                 const RunContext& context);

}  // namespace rilievo
