#include "core/base/run_concurrently.h"

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>

#include "core/base/helper_threads.h"

namespace rilievo {
namespace {

// Outlives the call where a helper comes when all is done.
class Aside {
 public:
  explicit Aside(const std::function<absl::Status()>& task) : task_(task) {}

  // Whoever comes first runs the task.
  void Run() {
    {
      const std::lock_guard lock(mutex_);
      if (taken_) return;
      taken_ = true;
    }
    absl::Status status;
    std::exception_ptr failure;
    try {
      status = task_();
    } catch (...) {
      failure = std::current_exception();
    }
    status_ = status;
    failure_ = failure;
    done_ = true;
    NudgeHelpers();
  }

  // Helps meanwhile: what keeps the task busy may be a loop of many blocks.
  absl::Status Wait() {
    if (!done_) {
      HelpUntil([this] { return done_.load(); });
    }
    if (failure_) std::rethrow_exception(failure_);
    return status_;
  }

 private:
  const std::function<absl::Status()>& task_;  // not touched once taken
  std::mutex mutex_;
  bool taken_ = false;
  std::atomic<bool> done_ = false;  // the two below are whole then
  absl::Status status_;
  std::exception_ptr failure_;
};

}  // namespace

absl::Status RunConcurrently(const RunContext& context, const std::function<absl::Status()>& here,
                             const std::function<absl::Status()>& aside) {
  const auto task = std::make_shared<Aside>(aside);
  OfferWork(context.ThreadCount() - 1 > 0 ? 1 : 0, [task] { task->Run(); });
  absl::Status status;
  std::exception_ptr failure;
  try {
    status = here();
  } catch (...) {
    failure = std::current_exception();
  }
  task->Run();
  const absl::Status aside_status = task->Wait();
  if (failure) std::rethrow_exception(failure);
  return status.ok() ? aside_status : status;
}

}  // namespace rilievo
