// Which heights are smoothed, as a file tells it: a chunk, or a word where all are alike.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
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
