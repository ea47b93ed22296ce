#include "core/base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace rilievo {

absl::Status ParallelFor(int64_t count, int64_t block, const RunContext& context,
                         const std::function<void(int64_t begin, int64_t end)>& body) {
  if (count <= 0) return context.CheckStop();
  block = std::max<int64_t>(1, block);
  const int64_t block_count = (count + block - 1) / block;
  std::atomic<int64_t> next{0};
  std::atomic<bool> stopped{false};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    for (;;) {
      if (context.stop.stop_requested()) {
        stopped = true;
        return;
      }
      const int64_t index = next.fetch_add(1);
      if (index >= block_count) return;
      try {
        body(index * block, std::min(count, (index + 1) * block));
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
        next = block_count;  // nobody takes another block
        return;
      }
    }
  };
  const int64_t workers = std::min<int64_t>(context.ThreadCount(), block_count);
  {
    std::vector<std::jthread> pool;
    pool.reserve(static_cast<size_t>(workers - 1));
    for (int64_t i = 1; i < workers; ++i) pool.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return stopped ? context.CheckStop() : absl::OkStatus();
}

}  // namespace rilievo
