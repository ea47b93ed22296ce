// The parts of large jobs that the workers of a shared store do.
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/job_store.h"

namespace rilievo {

absl::Status JobStore::LeadParts(const PartWorker& leader) {
  const auto tables = tables_->Take();
  return Free(tables.get(), [&]() -> absl::Status {
    // Those who help make none meanwhile.
    RILIEVO_RETURN_IF_ERROR(JobQueue(&tables->database()).Lock(leader.job_id));
    return tables->DropPartsOfOthers(leader);
  });
}

absl::StatusOr<PartQueue::Turn> JobStore::TakePart(const PartWorker& worker, PartStep step,
                                                   int count) {
  // One that it took and never heard of, as when the connection broke, is free again before long.
  Hold(worker.job_id, worker.worker, std::nullopt);
  const auto tables = tables_->Take();
  auto turn = PartQueue(&tables->database()).Take(worker, step, count, settings_.checked_share);
  if (turn.ok()) Hold(worker.job_id, worker.worker, turn->claim);
  return turn;
}

void JobStore::Hold(const std::string& job_id, const std::string& worker,
                    const std::optional<PartClaim>& claim) {
  const std::lock_guard lock(held_mutex_);
  if (claim) {
    held_[{job_id, worker}] = *claim;
  } else {
    held_.erase(std::pair(job_id, worker));
  }
}

std::vector<PartClaim> JobStore::HeldBy(const std::string& worker) const {
  const std::lock_guard lock(held_mutex_);
  std::vector<PartClaim> claims;
  for (const auto& [whose, claim] : held_) {
    if (whose.second == worker || whose.second == NameOfHelper(worker)) claims.push_back(claim);
  }
  return claims;
}

absl::Status JobStore::MakeRoomForPart(JobTables* tables, const PartClaim& claim,
                                       const StagedBlob& result) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t reserved, tables->BytesReserved(claim.job_id));
  if (result.bytes() <= reserved) return absl::OkStatus();
  // It adds nothing to what is there, whether it replaces that or goes.
  RILIEVO_ASSIGN_OR_RETURN(
      const std::string known,
      PartQueue(&tables->database()).Result(claim.job_id, claim.step, claim.part));
  if (!known.empty()) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const bool is_there, tables->Uses(claim.owner, result.name()));
  if (is_there) return absl::OkStatus();
  const absl::Status made = MakeRoom(tables, claim.owner, result.bytes() - reserved, {});
  if (!absl::IsResourceExhausted(made)) return made;
  return StatusOf({ErrorCause::kStoreFull,
                   "the store has no room for what comes of the parts of the job; delete jobs and "
                   "scans that are no longer needed, then create it again"});
}

absl::Status JobStore::KeepPart(const PartClaim& claim, const BlobSource& bytes) {
  RILIEVO_ASSIGN_OR_RETURN(const auto staged, blobs_->StageFrom(bytes));
  const auto tables = tables_->Take();
  RILIEVO_RETURN_IF_ERROR(MakeRoomForPart(tables.get(), claim, *staged));
  PartQueue::Finished finished;
  const absl::Status kept = Adopt(tables.get(), *staged, [&]() -> absl::Status {
    JobQueue queue(&tables->database());
    RILIEVO_RETURN_IF_ERROR(queue.Lock(claim.job_id));
    RILIEVO_ASSIGN_OR_RETURN(finished,
                             PartQueue(&tables->database()).Finish(claim, staged->name()));
    using Kept = PartQueue::Kept;
    if (finished.kept == Kept::kOthers) return absl::AbortedError("somebody else does the part");
    if (finished.kept == Kept::kSame) return absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(tables->UsePart(claim.owner, staged->name()));
    const std::string& needless =
        finished.kept == Kept::kDoubtful ? staged->name() : finished.wrong;
    return needless.empty() ? absl::OkStatus() : tables->DropPart(claim.owner, needless);
  });
  if (kept.ok() && !finished.wrong_by.empty()) {
    Report(absl::StrCat("part ", claim.part, " of step ", static_cast<int>(claim.step), " of job ",
                        claim.job_id, ": what ", finished.wrong_by,
                        " has found is wrong: its memory or its processor is at fault"));
  }
  if (kept.ok() || absl::IsAborted(kept)) Hold(claim.job_id, claim.worker, std::nullopt);
  if (!absl::IsAborted(kept)) return kept;
  RILIEVO_ASSIGN_OR_RETURN(const bool goes_on, PartQueue(&tables->database()).Waits(claim.job_id));
  return goes_on ? absl::OkStatus() : absl::FailedPreconditionError("the job ended");
}

absl::StatusOr<FileDescriptor> JobStore::ReadPart(const std::string& job_id, PartStep step,
                                                  int part, std::string* sha256) {
  {
    const auto tables = tables_->Take();
    RILIEVO_ASSIGN_OR_RETURN(*sha256, PartQueue(&tables->database()).Result(job_id, step, part));
  }
  absl::StatusOr<FileDescriptor> file = blobs_->Read(*sha256);
  // It went while it was read.
  if (absl::IsDataLoss(file.status())) return absl::NotFoundError(file.status().message());
  return file;
}

absl::Status JobStore::DropPart(const PartWorker& worker, PartStep step, int part,
                                const std::string& sha256) {
  const auto tables = tables_->Take();
  return Free(tables.get(), [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        const bool dropped,
        PartQueue(&tables->database()).Reopen(worker.job_id, step, part, sha256));
    if (!dropped) return absl::OkStatus();
    Report(absl::StrCat("part ", part, " of job ", worker.job_id, " is damaged; it is set aside"));
    RILIEVO_RETURN_IF_ERROR(blobs_->SetAside(sha256));
    return tables->DropPart(worker.owner, sha256);
  });
}

absl::Status JobStore::ReleaseParts(const std::string& job_id, const std::string& worker) {
  Hold(job_id, worker, std::nullopt);
  const auto tables = tables_->Take();
  return PartQueue(&tables->database()).Release(job_id, worker);
}

absl::StatusOr<std::optional<StoredJob>> JobStore::JobToHelp(const ClaimDemand& worker,
                                                             const std::string& recipe,
                                                             const std::set<std::string>& except) {
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(
      const auto ids,
      PartQueue(&tables->database()).JobsToHelp(worker.worker, worker.memory, recipe));
  for (const std::string& id : ids) {
    if (except.count(id) != 0) continue;
    RILIEVO_ASSIGN_OR_RETURN(auto stored, tables->Find(id));
    ReportDamaged(tables.get());
    if (!stored) continue;
    stored->worker = NameOfHelper(worker.worker);
    return stored;
  }
  return std::nullopt;
}

absl::StatusOr<bool> JobStore::IsUnfinished(const std::string& job_id) {
  const auto tables = tables_->Take();
  return PartQueue(&tables->database()).Waits(job_id);
}

}  // namespace rilievo
