// Two tasks at the same time.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "core/base/run_context.h"

namespace rilievo {

// Runs `here` on the calling thread and `aside` on another one meanwhile; where the context has one
// thread, or none is free in time, one after the other. So only `here` may report progress, and
// neither may write what the other one touches. The first error of (here, aside), whichever came
// first; an exception of either is thrown on once both have ended.
absl::Status RunConcurrently(const RunContext& context, const std::function<absl::Status()>& here,
                             const std::function<absl::Status()>& aside);

}  // namespace rilievo
