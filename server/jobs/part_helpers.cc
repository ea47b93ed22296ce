#include "server/jobs/part_helpers.h"

#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/observability/server_log.h"

namespace rilievo {
namespace {

// A job that cannot be helped here, as for want of room on the disk, is left to others for so long;
// one whose process was killed not quite so long.
constexpr std::chrono::seconds kLeftAlone{30}, kKilledPause{1};

}  // namespace

PartHelpers::~PartHelpers() {
  std::unique_lock lock(mutex_);
  for (auto job = helped_.begin(); job != helped_.end();) {
    job->second.run->Stop(StopReason::kShutdown);
    job = core_->pool.Withdraw(job->second.work_number) ? helped_.erase(job) : std::next(job);
  }
  idle_.wait(lock, [this] { return helped_.empty(); });
}

int PartHelpers::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(helped_.size());
}

bool PartHelpers::Help(const ClaimDemand& demand) {
  if (core_->options.scratch.empty()) return false;
  std::set<std::string> except;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(left_, [](const auto& job) { return job.second < Clock::now(); });
    for (const auto& [id, helped] : helped_) except.insert(id);
    for (const auto& [id, until] : left_) except.insert(id);
  }
  const auto found = store_->JobToHelp(demand, PartsInStore::Recipe(core_->options), except);
  if (!found.ok() || !*found) return false;
  const StoredJob& stored = **found;
  const std::string& id = stored.job.job_id();
  const auto run = std::make_shared<JobRun>(core_, store_, stored, nullptr);
  const int64_t memory = board_->MemoryOf(stored);
  const std::lock_guard lock(mutex_);
  Helped& helped = helped_[id];
  helped.run = run;
  helped.work_number = core_->pool.Submit([this, id, run] { Work(id, run); },
                                          {.client = stored.client, .memory = memory});
  return true;
}

void PartHelpers::Work(const std::string& job_id, const std::shared_ptr<JobRun>& run) {
  core_->live_calls.Enter(run);
  const absl::Status done = run->Help();
  core_->live_calls.Leave(run.get());
  const std::lock_guard lock(mutex_);
  if (!done.ok() && !run->stopped()) {
    LogMessage(absl::StrCat("job ", job_id, ": not helped: ", done.message()));
    left_[job_id] = Clock::now() + (absl::IsAborted(done) ? kKilledPause : kLeftAlone);
  }
  helped_.erase(job_id);
  idle_.notify_all();  // under the lock: whoever waits may destroy this object
}

void PartHelpers::Look() {
  std::vector<std::pair<std::string, std::shared_ptr<JobRun>>> runs;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, helped] : helped_) runs.emplace_back(id, helped.run);
  }
  for (const auto& [id, run] : runs) {
    const auto waits = store_->IsUnfinished(id);
    if (waits.ok() && !*waits) run->Stop(StopReason::kClient);
  }
}

}  // namespace rilievo
