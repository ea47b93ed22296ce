#include "tests/stress/ledger.h"

#include "absl/strings/str_format.h"
#include "tests/stress/known_scans.h"

namespace rilievo::stress {
namespace {

constexpr std::chrono::seconds kPatience{120};

// Why the job has not the right bytes: its own error when it failed.
std::string FaultOf(const absl::StatusOr<v1::Job>& job, const absl::Status& fetched) {
  if (!job.ok()) return job.status().ToString();
  if (job->state() == v1::JOB_STATE_FAILED) {
    return absl::StrFormat("%s failed after %d attempts: %s", job->job_id(), job->attempts(),
                           job->error().message());
  }
  return fetched.ok() ? "other bytes" : fetched.ToString();
}

}  // namespace

std::string Audit::Words() const {
  return absl::StrFormat(
      "%d acknowledged, %d with the right bytes, %d cancelled, %d wrong, %d unknown, %d "
      "attempts%s%s",
      jobs, succeeded, cancelled, wrong, extra, attempts, first_fault.empty() ? "" : "; ",
      first_fault);
}

void Ledger::Acknowledged(const std::string& job_id, size_t scan) {
  const std::lock_guard lock(mutex_);
  entries_[job_id].scan = scan;
}

void Ledger::Cancelled(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  entries_[job_id].cancelled = true;
}

Audit Ledger::Check(const StressServer& server) const {
  const std::lock_guard lock(mutex_);
  Audit audit;
  const JobsClient jobs = server.Jobs(OwnConnection(server.address()));
  for (const auto& [id, entry] : entries_) {
    ++audit.jobs;
    const auto done = jobs.Watch(id, {}, Within(kPatience));
    if (done.ok()) audit.attempts += static_cast<int>(done->attempts());
    if (done.ok() && done->state() == v1::JOB_STATE_CANCELLED && entry.cancelled) {
      ++audit.cancelled;
      continue;
    }
    const auto surface = jobs.Fetch(id, {}, Within(kPatience));
    if (surface.ok() && *surface == KnownScans()[entry.scan].surface) {
      ++audit.succeeded;
      continue;
    }
    ++audit.wrong;
    if (audit.first_fault.empty()) audit.first_fault = FaultOf(done, surface.status());
  }
  const auto listed = jobs.List(1'000'000, Within(kPatience));
  if (!listed.ok()) {
    audit.first_fault = listed.status().ToString();
    audit.extra = -1;
    return audit;
  }
  for (const v1::Job& job : *listed) audit.extra += !entries_.contains(job.job_id());
  // One that is kept but not listed would be lost to its client.
  if (listed->size() < entries_.size()) ++audit.wrong;
  return audit;
}

}  // namespace rilievo::stress
