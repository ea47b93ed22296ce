#include "server/jobs/fleet_member.h"

#include <unistd.h>

#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/observability/server_log.h"

namespace rilievo {
namespace {

using Clock = std::chrono::steady_clock;

// Between two looks for a job that another server has created, and for what becomes of those that
// others work on.
constexpr std::chrono::milliseconds kPause{250};
// Also the longest time until a job that was cancelled elsewhere is stopped.
constexpr std::chrono::seconds kRenewal{1};

// For people first: the machine and the process.
std::string NewName() {
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  std::random_device random;
  return absl::StrCat(host, ".", getpid(), ".", absl::Hex(random(), absl::kZeroPad8));
}

}  // namespace

FleetMember::FleetMember(ServiceCore* core, JobStore* store, JobBoard* board, bool works)
    : core_(core),
      store_(store),
      board_(board),
      works_(works),
      name_(NewName()),
      busy_(Clock::now()),
      helpers_(core, store, board) {
  core_->pool.WhenFree([this] { Wake(); });
  thread_ = std::jthread([this](const std::stop_token& stop) { WorkUntil(stop); });
}

FleetMember::~FleetMember() { core_->pool.WhenFree({}); }

void FleetMember::Wake() {
  const std::lock_guard lock(mutex_);
  woken_ = true;
  wake_.notify_all();
}

Clock::duration FleetMember::IdleTime() const {
  const std::lock_guard lock(mutex_);
  return Clock::now() - busy_;
}

bool FleetMember::Note(const absl::Status& status) {
  if (status.ok() == away_) {
    LogMessage(away_ ? "store: it is back" : absl::StrCat("store: ", status.message()));
    away_ = !away_;
  }
  return status.ok();
}

ClaimDemand FleetMember::Demand() const {
  const JobPool::State pool = core_->pool.state();
  return {.worker = name_,
          .memory = core_->options.MemoryBudget(),
          .idle = pool.running == 0 && pool.waiting == 0};
}

void FleetMember::WorkUntil(const std::stop_token& stop) {
  Clock::time_point next_renewal{};
  bool renewed = false;
  while (!stop.stop_requested()) {
    const bool due = Clock::now() >= next_renewal;
    if (due) next_renewal = Clock::now() + kRenewal;
    if (due) LookAround();
    if (works_) {
      if (due) renewed = Renew();
      // Or it might take over from itself what it works on.
      if (renewed) Claim();
    }
    // Leases must not run out over those who only watch.
    board_->FollowOthers(next_renewal);
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, kPause, [this] { return woken_; });
    woken_ = false;
  }
}

void FleetMember::LookAround() {
  const auto counts = store_->CountUnfinished("");
  if (!Note(counts.status())) return core_->metrics->SetFleet(std::nullopt);
  core_->metrics->SetFleet(FleetState{.queued = counts->waiting,
                                      .running = counts->all - counts->waiting,
                                      .workers = counts->workers});
}

bool FleetMember::Renew() {
  if (board_->size() + helpers_.size() > 0) {
    const std::lock_guard lock(mutex_);
    busy_ = Clock::now();
  }
  int64_t freed = 0;
  const auto held = store_->Renew(Demand(), &freed);
  if (!Note(held.status())) return false;
  core_->metrics->CountLostLeases(freed);
  board_->Compare(*held);
  board_->TellOthers();
  helpers_.Look();
  return true;
}

void FleetMember::Claim() {
  while (!core_->draining && core_->pool.FreePlaces() > 0) {
    auto taken = store_->Claim(Demand());
    if (!Note(taken.status())) return;
    if (!*taken && !helpers_.Help(Demand())) return;
    {
      const std::lock_guard lock(mutex_);
      busy_ = Clock::now();
    }
    if (*taken) board_->TakeUp(**std::move(taken));
  }
}

}  // namespace rilievo
