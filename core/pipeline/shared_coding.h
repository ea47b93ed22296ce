// What processes that share a large surface's coding tell each other.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/codec/heights/encode_blocks.h"
#include "core/paging/shared_parts.h"
#include "core/pipeline/code_stored_surface.h"
#include "core/pipeline/code_surface.h"

namespace rilievo {

// Before the heights are coded, a step of its own: what `find` puts into `uncoded`, in the process
// that leads, is there in all.
absl::Status ShareUncoded(const std::function<absl::Status()>& find, SharedParts* shared,
                          const RunContext& context, UncodedError* uncoded);

// Passes over blocks, each call a step of its own, as long as there are steps (kMostPasses). A part
// of it is of several blocks, for most of what codes one is done by one thread.
GatherBytes GatherByParts(SharedParts* shared);

// All but the metadata and the error, as they are kept.
std::vector<uint8_t> BytesOfCoded(const CodedStoredSurface& coded);
// Whether they are such bytes.
bool ReadCoded(std::span<const uint8_t> bytes, CodedStoredSurface* coded);

}  // namespace rilievo
