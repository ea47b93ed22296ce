// A long loop on one thread that can be stopped.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"

namespace rilievo {

// Calls body(index) for 0 <= index < count in turn, for steps that depend on those before them.
// CANCELLED as soon as the stop token says so, asked every 8192 steps: a step should take well
// under 10 us. What was done by then stays half done.
template <typename Body>
absl::Status SerialFor(int64_t count, const RunContext& context, const Body& body) {
  constexpr int64_t kBlock = 8192;
  for (int64_t begin = 0; begin < count; begin += kBlock) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const int64_t end = std::min(count, begin + kBlock);
    for (int64_t index = begin; index < end; ++index) body(index);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
