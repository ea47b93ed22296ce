// How the workers of a shared store come to their jobs.
#include <utility>

#include "core/base/status_macros.h"
#include "server/store/job_store.h"

namespace rilievo {

absl::StatusOr<std::optional<StoredJob>> JobStore::Claim(const ClaimDemand& demand) {
  const auto tables = tables_->Take();
  JobQueue queue(&tables->database());
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const std::optional<JobClaim> claim, queue.Claim(demand));
    if (!claim) return std::nullopt;
    RILIEVO_ASSIGN_OR_RETURN(std::optional<StoredJob> stored, tables->Find(claim->job_id));
    ReportDamaged(tables.get());
    if (stored) {
      stored->claim = claim->number;
      stored->worker = claim->worker;
      stored->memory = claim->memory;
      return stored;
    }
    // Its record is damaged, or it was removed just now.
    RILIEVO_RETURN_IF_ERROR(queue.Remove(claim->job_id));
  }
}

absl::StatusOr<std::vector<JobClaim>> JobStore::Renew(const ClaimDemand& worker, int64_t* freed) {
  const auto tables = tables_->Take();
  int64_t count = 0;
  RILIEVO_RETURN_IF_ERROR(PartQueue(&tables->database()).Renew(HeldBy(worker.worker)));
  return JobQueue(&tables->database()).Renew(worker, freed == nullptr ? &count : freed);
}

absl::Status JobStore::Release(const StoredJob& stored, bool last) {
  const auto tables = tables_->Take();
  return Write(tables.get(), [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(ChangeJob(tables.get(), stored));
    if (stored.claim == 0) return absl::OkStatus();
    return JobQueue(&tables->database())
        .Release({.job_id = stored.job.job_id(), .number = stored.claim, .worker = stored.worker},
                 IsSuspect(stored), last);
  });
}

// A job that its last worker left behind may well have been begun: whoever takes it counts that.
absl::Status JobStore::Release(const JobClaim& claim) {
  const auto tables = tables_->Take();
  JobQueue queue(&tables->database());
  RILIEVO_ASSIGN_OR_RETURN(const auto stored, tables->Find(claim.job_id));
  return queue.Release(claim, stored && stored->unclean_ends >= kSuspectEnds - 1, /*last=*/false);
}

absl::Status JobStore::Tell(const JobClaim& claim, const v1::JobEvent& event) {
  const auto tables = tables_->Take();
  return JobQueue(&tables->database()).Tell(claim, event.SerializeAsString());
}

absl::StatusOr<JobStore::Glance> JobStore::Look(const std::string& owner,
                                                const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(StoredJob stored, Get(owner, job_id));
  Glance glance;
  glance.job = std::move(stored.job);
  if (IsFinished(glance.job.state())) return glance;
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(const std::string bytes,
                           JobQueue(&tables->database()).LatestEvent(job_id));
  v1::JobEvent event;
  if (!bytes.empty() && event.ParseFromString(bytes)) glance.event = std::move(event);
  return glance;
}

absl::StatusOr<JobQueue::Counts> JobStore::CountUnfinished(const std::string& client) {
  const auto tables = tables_->Take();
  return JobQueue(&tables->database()).Count(client);
}

}  // namespace rilievo
