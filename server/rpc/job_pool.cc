#include "server/rpc/job_pool.h"

#include <algorithm>
#include <utility>

namespace rilievo {
namespace {

constexpr double kMeanWeight = 0.3;  // of the latest job

}  // namespace

JobPool::Ticket& JobPool::Ticket::operator=(Ticket&& other) noexcept {
  std::swap(pool_, other.pool_);
  std::swap(client_, other.client_);
  return *this;
}

JobPool::Ticket::~Ticket() {
  if (pool_ != nullptr) pool_->Release(client_);
}

JobPool::Charge& JobPool::Charge::operator=(Charge&& other) noexcept {
  std::swap(pool_, other.pool_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

JobPool::Charge::~Charge() { Set(0); }

void JobPool::Charge::Set(int64_t bytes) {
  if (bytes != bytes_) pool_->ChangeCharged(bytes - bytes_);
  bytes_ = bytes;
}

JobPool::JobPool(int workers, int waiting, int64_t memory)
    : workers_(workers), memory_(memory), admissions_(workers + waiting) {
  threads_.reserve(static_cast<size_t>(workers));
  for (int i = 0; i < workers; ++i) threads_.emplace_back([this] { Work(); });
}

JobPool::~JobPool() {
  std::list<Line> dropped;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    dropped.swap(lines_);
    dropped.push_back(std::move(last_));
  }
  wake_.notify_all();
  threads_.clear();
}

std::optional<JobPool::Ticket> JobPool::TryAdmit(const std::string& client) {
  if (!admissions_.Take(client)) return std::nullopt;
  return Ticket(this, client);
}

std::optional<JobPool::Charge> JobPool::TryCharge(int64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (charged_ > 0 && bytes > memory_ - charged_) return std::nullopt;
  charged_ += bytes;
  TellHeart();
  return Charge(this, bytes);
}

void JobPool::ChangeCharged(int64_t by) {
  {
    const std::lock_guard lock(mutex_);
    charged_ += by;
    TellHeart();
  }
  if (by < 0) wake_.notify_all();
}

void JobPool::Release(const std::string& client) { admissions_.Give(client); }

uint64_t JobPool::Submit(std::function<void()> work, const Demand& demand) {
  uint64_t number;
  {
    const std::lock_guard lock(mutex_);
    number = next_number_++;
    Entry entry{number, std::move(work), demand.memory, std::chrono::steady_clock::now()};
    auto line = std::find_if(lines_.begin(), lines_.end(),
                             [&](const Line& other) { return other.client == demand.client; });
    if (demand.last) {
      entry.memory = memory_;
      last_.entries.push_back(std::move(entry));
    } else {
      if (line == lines_.end()) line = lines_.insert(line, {demand.client, {}});
      line->entries.push_back(std::move(entry));
    }
    TellHeart();
  }
  wake_.notify_one();
  return number;
}

bool JobPool::Withdraw(uint64_t number) {
  // Destroyed after the lock is released: what it holds may call back.
  Entry withdrawn{};
  bool found = false;
  {
    const std::lock_guard lock(mutex_);
    found = WithdrawFrom(&last_, number, &withdrawn);
    for (auto line = lines_.begin(); line != lines_.end() && !found; ++line) {
      found = WithdrawFrom(&*line, number, &withdrawn);
      if (!line->entries.empty()) continue;
      lines_.erase(line);
      break;
    }
    TellHeart();
  }
  // The job behind it may need less memory.
  if (found) wake_.notify_all();
  return found;
}

void JobPool::Hold(std::chrono::milliseconds time) {
  const auto now = std::chrono::steady_clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (time.count() <= 0 && held_until_ <= now) return;
    held_until_ = now + time;
    TellHeart();
  }
  wake_.notify_all();
}

bool JobPool::WithdrawFrom(Line* line, uint64_t number, Entry* withdrawn) {
  const auto entry = std::find_if(line->entries.begin(), line->entries.end(),
                                  [&](const Entry& other) { return other.number == number; });
  if (entry == line->entries.end()) return false;
  *withdrawn = std::move(*entry);
  line->entries.erase(entry);
  return true;
}

bool JobPool::HasRoomForNext() const {
  if (std::chrono::steady_clock::now() < held_until_) return false;
  if (lines_.empty()) return running_ == 0 && !last_.entries.empty();
  const int64_t needed = lines_.front().entries.front().memory;
  return running_ == 0 || needed <= memory_ - memory_in_use_ - charged_;
}

JobPool::Entry JobPool::TakeNext() {
  if (lines_.empty()) {
    Entry entry = std::move(last_.entries.front());
    last_.entries.pop_front();
    return entry;
  }
  Entry entry = std::move(lines_.front().entries.front());
  lines_.front().entries.pop_front();
  if (lines_.front().entries.empty()) {
    lines_.pop_front();
  } else {
    lines_.splice(lines_.end(), lines_, lines_.begin());  // the others come first now
  }
  return entry;
}

int JobPool::FreePlaces() const {
  const std::lock_guard lock(mutex_);
  if (closing_ || std::chrono::steady_clock::now() < held_until_) return 0;
  size_t waiting = last_.entries.size();
  for (const Line& line : lines_) waiting += line.entries.size();
  return std::max(0, workers_ - running_ - static_cast<int>(waiting));
}

void JobPool::WhenFree(std::function<void()> tell) {
  const std::lock_guard lock(mutex_);
  when_free_ = std::move(tell);
}

std::chrono::milliseconds JobPool::RetryDelay() const {
  const double rounds = static_cast<double>(admissions_.taken()) / workers_;
  const std::lock_guard lock(mutex_);
  return std::chrono::milliseconds(
      static_cast<int64_t>(1000 * std::clamp(rounds * mean_seconds_, 1.0, 60.0)));
}

JobPool::State JobPool::state() const {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  State state;
  state.running = running_;
  std::vector<const Line*> lines = {&last_};
  for (const Line& line : lines_) lines.push_back(&line);
  for (const Line* line : lines) {
    state.waiting += static_cast<int>(line->entries.size());
    for (const Entry& entry : line->entries) {
      state.oldest_wait =
          std::max<std::chrono::duration<double>>(state.oldest_wait, now - entry.since);
    }
  }
  return state;
}

int JobPool::admitted() const { return static_cast<int>(admissions_.taken()); }

int JobPool::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

void JobPool::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    while (!closing_ && !HasRoomForNext()) {
      if (std::chrono::steady_clock::now() < held_until_) {
        wake_.wait_until(lock, held_until_);
      } else if (!HasRoomForNext()) {  // not since the time is over
        wake_.wait(lock);
      }
    }
    if (closing_) return;
    Entry entry = TakeNext();
    ++running_;
    memory_in_use_ += entry.memory;
    heart_.Beat();
    TellHeart();
    lock.unlock();
    const auto start = std::chrono::steady_clock::now();
    entry.work();
    entry.work = nullptr;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    lock.lock();
    --running_;
    memory_in_use_ -= entry.memory;
    TellHeart();
    mean_seconds_ += kMeanWeight * (seconds.count() - mean_seconds_);
    wake_.notify_all();  // there may be room for several
    if (when_free_) when_free_();
  }
}

}  // namespace rilievo
