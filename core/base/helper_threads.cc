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

 private:
  // Where no thread can be had, whoever offers the work does it alone.
  void StartThreads(int wanted) {
    try {
      for (; threads_ < wanted; ++threads_) std::thread([this] { Help(); }).detach();
    } catch (const std::system_error&) {
      if (threads_ == 0) offers_.clear();
    }
  }

  [[noreturn]] void Help() {
    for (;;) {
      std::function<void()> help;
      {
        std::unique_lock lock(mutex_);
        offered_.wait(lock, [this] { return !offers_.empty(); });
        help = std::move(offers_.front());
        offers_.pop_front();
      }
      help();
    }
  }

  std::mutex mutex_;
  std::condition_variable offered_;
  std::deque<std::function<void()>> offers_;
  int threads_ = 0;
};

}  // namespace

void OfferWork(int helpers, std::function<void()> help) {
  // Never destroyed: its threads wait on it until the process ends.
  static HelperThreads& threads = *new HelperThreads;
  if (helpers > 0) threads.Offer(helpers, help);
}

}  // namespace rilievo
