// A sort on the context's threads that can be stopped.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/parallel_for.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"

namespace rilievo {

// Ascending by `less`, which must be a strict weak order in which only equal values are
// equivalent: then the result does not depend on the number of threads. Runs are sorted, then
// merged in pairs. CANCELLED leaves the values in no order, some of them twice.
template <typename Value, typename Less>
absl::Status ParallelSort(const Less& less, const RunContext& context, std::vector<Value>* values) {
  constexpr int64_t kRun = 1 << 17;
  const auto count = static_cast<int64_t>(values->size());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kRun, context, [&](int64_t begin, int64_t end) {
    std::sort(values->begin() + begin, values->begin() + end, less);
  }));
  if (count <= kRun) return absl::OkStatus();
  std::vector<Value> merged(values->size());
  for (int64_t width = kRun; width < count; width *= 2) {
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, 2 * width, context, [&](int64_t begin, int64_t end) {
      const int64_t middle = std::min(begin + width, end);
      std::merge(values->begin() + begin, values->begin() + middle, values->begin() + middle,
                 values->begin() + end, merged.begin() + begin, less);
    }));
    values->swap(merged);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
