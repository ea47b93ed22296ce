// The flags of smoothed heights in memory that does not grow with them.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/encode_blocks.h"
#include "core/codec/heights/encode_smoothed_flags.h"

namespace rilievo {

// As EncodeSmoothedFlags.
absl::StatusOr<EncodedFlags> EncodeSmoothedBlocks(const EncodeBlocks& blocks, int smallest,
                                                  int64_t bytes, int64_t most,
                                                  const RunContext& context);

}  // namespace rilievo
