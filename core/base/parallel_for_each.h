// Independent work on single indices on the context's threads.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/base/parallel_for.h"
#include "core/base/run_context.h"

namespace rilievo {

// As ParallelFor, calling body(index) for each index: body(int64_t).
template <typename Body>
absl::Status ParallelForEach(int64_t count, int64_t block, const RunContext& context,
                             const Body& body) {
  return ParallelFor(count, block, context, [&body](int64_t begin, int64_t end) {
    for (int64_t index = begin; index < end; ++index) body(index);
  });
}

}  // namespace rilievo
