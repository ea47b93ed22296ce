// Blocks of independent work on the context's threads.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/status.h"
#include "core/base/run_context.h"

namespace rilievo {

// Indices in a block, by what one of them costs: enough of them that handing out a block costs
// nothing beside its work, few enough that all threads end at about the same time.
inline constexpr int64_t kLightBlock = 8192;   // arithmetic
inline constexpr int64_t kSearchBlock = 1024;  // a search among the neighbours
inline constexpr int64_t kHeavyBlock = 64;     // a fit, a walk over the surface

// Calls body(begin, end) for consecutive blocks of at most `block` indices that cover [0, count).
// Blocks are handed out dynamically, so `body` must write only to places owned by its indices;
// then the result does not depend on the number of threads. Between blocks the stop token is
// asked: CANCELLED is returned and the remaining blocks are skipped. What `body` throws (memory may
// run out in it) is thrown here once all threads have ended, and the remaining blocks are skipped.
absl::Status ParallelFor(int64_t count, int64_t block, const RunContext& context,
                         const std::function<void(int64_t begin, int64_t end)>& body);

}  // namespace rilievo
