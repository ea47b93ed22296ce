// What core/base does with threads and pages of memory, on a machine that has neither.
#include <algorithm>

#include "core/base/large_pages.h"
#include "core/base/parallel_for.h"

namespace rilievo {

absl::Status ParallelFor(int64_t count, int64_t block, const RunContext& context,
                         const std::function<void(int64_t begin, int64_t end)>& body) {
  block = std::max<int64_t>(1, block);
  for (int64_t begin = 0; begin < count; begin += block) {
    body(begin, std::min(count, begin + block));
  }
  return context.CheckStop();
}

void HintLargePages(void*, size_t) {}

}  // namespace rilievo

// Nothing is thrown or caught in this build: what would be an exception (no memory left, say) ends
// the instance with a trap, and the page makes a new one.
extern "C" {
[[gnu::used]] void* __cxa_allocate_exception(size_t) { __builtin_trap(); }
[[gnu::used]] void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }
// The one thread ends with the instance: its variables are never destroyed.
[[gnu::used]] int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; }
}
