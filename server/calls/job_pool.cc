#include "server/calls/job_pool.h"

#include <algorithm>
#include <utility>

namespace rilievo {
namespace {

constexpr double kMeanWeight = 0.3;  // of the latest job

}  // namespace

JobPool::Ticket& JobPool::Ticket::operator=(Ticket&& other) noexcept {
  std::swap(pool_, other.pool_);
  return *this;
}

JobPool::Ticket::~Ticket() {
  if (pool_ != nullptr) pool_->Release();
}

JobPool::JobPool(int workers, int waiting) : workers_(workers), places_(workers + waiting) {
  threads_.reserve(static_cast<size_t>(workers));
  for (int i = 0; i < workers; ++i) threads_.emplace_back([this] { Work(); });
}

JobPool::~JobPool() {
  std::deque<Entry> dropped;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    dropped.swap(queue_);
  }
  wake_.notify_all();
  threads_.clear();
}

std::optional<JobPool::Ticket> JobPool::TryAdmit() {
  const std::lock_guard lock(mutex_);
  if (admitted_ >= places_) return std::nullopt;
  ++admitted_;
  return Ticket(this);
}

void JobPool::Release() {
  const std::lock_guard lock(mutex_);
  --admitted_;
}

uint64_t JobPool::Submit(std::function<void()> work) {
  uint64_t number;
  {
    const std::lock_guard lock(mutex_);
    number = next_number_++;
    queue_.push_back({number, std::move(work)});
  }
  wake_.notify_one();
  return number;
}

bool JobPool::Withdraw(uint64_t number) {
  // Destroyed after the lock is released: what it holds may call back.
  Entry withdrawn{};
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(queue_.begin(), queue_.end(),
                                  [&](const Entry& entry) { return entry.number == number; });
  if (found == queue_.end()) return false;
  withdrawn = std::move(*found);
  queue_.erase(found);
  return true;
}

std::chrono::milliseconds JobPool::RetryDelay() const {
  const std::lock_guard lock(mutex_);
  const double rounds = static_cast<double>(admitted_) / workers_;
  return std::chrono::milliseconds(
      static_cast<int64_t>(1000 * std::clamp(rounds * mean_seconds_, 1.0, 60.0)));
}

int JobPool::admitted() const {
  const std::lock_guard lock(mutex_);
  return admitted_;
}

int JobPool::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

void JobPool::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (closing_) return;
    std::function<void()> work = std::move(queue_.front().work);
    queue_.pop_front();
    ++running_;
    lock.unlock();
    const auto start = std::chrono::steady_clock::now();
    work();
    work = nullptr;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    lock.lock();
    --running_;
    mean_seconds_ += kMeanWeight * (seconds.count() - mean_seconds_);
  }
}

}  // namespace rilievo
