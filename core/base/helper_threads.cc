#include "core/base/helper_threads.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace rilievo {
namespace {

constexpr int kMostThreads = 256;

class HelperThreads {
 public:
  void Offer(int helpers, const std::function<void()>& help) {
    {
      const std::lock_guard lock(mutex_);
      for (int i = 0; i < helpers; ++i) offers_.push_back(help);
      StartThreads(std::min(helpers, kMostThreads));
    }
    for (int i = 0; i < helpers; ++i) offered_.notify_one();
  }

  void HelpUntil(const std::function<bool()>& done) {
    for (;;) {
      std::function<void()> help;
      {
        std::unique_lock lock(mutex_);
        offered_.wait(lock, [&] { return !offers_.empty() || done(); });
        if (done()) {
          if (!offers_.empty()) offered_.notify_one();  // the call may have been for this thread
          return;
        }
        help = std::move(offers_.front());
        offers_.pop_front();
      }
      help();
    }
  }

  void Nudge() {
    { const std::lock_guard lock(mutex_); }
    offered_.notify_all();
  }

 private:
  // Where no thread can be had, whoever offers the work does it alone.
  void StartThreads(int wanted) {
    try {
      for (; threads_ < wanted; ++threads_)
        std::thread([this] { HelpUntil([] { return false; }); }).detach();
    } catch (const std::system_error&) {
      if (threads_ == 0) offers_.clear();
    }
  }

  std::mutex mutex_;
  std::condition_variable offered_;
  std::deque<std::function<void()>> offers_;
  int threads_ = 0;
};

HelperThreads& TheThreads() {
  // Never destroyed: its threads wait on it until the process ends.
  static HelperThreads& threads = *new HelperThreads;
  return threads;
}

}  // namespace

void OfferWork(int helpers, std::function<void()> help) {
  if (helpers > 0) TheThreads().Offer(helpers, help);
}

void HelpUntil(const std::function<bool()>& done) { TheThreads().HelpUntil(done); }

void NudgeHelpers() { TheThreads().Nudge(); }

}  // namespace rilievo
