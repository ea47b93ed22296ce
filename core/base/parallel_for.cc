#include "core/base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>

#include "core/base/helper_threads.h"

namespace rilievo {
namespace {

// The blocks of one call. Outlives it where a helper comes when all is done.
class BlockRun {
 public:
  BlockRun(int64_t count, int64_t block, const std::stop_token& stop,
           const std::function<void(int64_t, int64_t)>& body)
      : count_(count), block_(block), stop_(stop), body_(body) {}

  void Help() {
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return;
      ++helping_;
    }
    Work();
    const std::lock_guard lock(mutex_);
    if (--helping_ == 0) idle_.notify_all();
  }

  void Work() {
    for (;;) {
      if (stop_.stop_requested()) {
        stopped_ = true;
        return;
      }
      const int64_t begin = next_.fetch_add(block_);
      if (begin >= count_) return;
      try {
        body_(begin, std::min(count_, begin + block_));
      } catch (...) {
        const std::lock_guard lock(mutex_);
        if (!failure_) failure_ = std::current_exception();
        next_ = count_;  // nobody takes another block
        return;
      }
    }
  }

  // Waits for the helpers that came, not for those that did not: on a busy machine that may take
  // longer than the work.
  void Close() {
    std::unique_lock lock(mutex_);
    closed_ = true;
    idle_.wait(lock, [this] { return helping_ == 0; });
    if (failure_) std::rethrow_exception(failure_);
  }

  bool stopped() const { return stopped_; }

 private:
  const int64_t count_, block_;
  const std::stop_token stop_;
  const std::function<void(int64_t, int64_t)>& body_;  // not touched once closed
  std::atomic<int64_t> next_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  std::condition_variable idle_;
  std::exception_ptr failure_;
  int helping_ = 0;
  bool closed_ = false;
};

}  // namespace

absl::Status ParallelFor(int64_t count, int64_t block, const RunContext& context,
                         const std::function<void(int64_t begin, int64_t end)>& body) {
  if (count <= 0) return context.CheckStop();
  block = std::max<int64_t>(1, block);
  const int64_t block_count = (count + block - 1) / block;
  const int helpers = static_cast<int>(std::min<int64_t>(context.ThreadCount(), block_count)) - 1;
  const auto run = std::make_shared<BlockRun>(count, block, context.stop, body);
  OfferWork(helpers, [run] { run->Help(); });
  run->Work();
  run->Close();
  return run->stopped() ? context.CheckStop() : absl::OkStatus();
}

}  // namespace rilievo
