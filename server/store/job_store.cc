#include "server/store/job_store.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/control_mesh_blob.h"

namespace rilievo {
namespace {

absl::Status NoSuchJob() {
  return StatusOf({ErrorCause::kJobNotFound, "there is no such job; it may have been removed"});
}

absl::Status NoSuchScan() {
  return StatusOf({ErrorCause::kScanNotFound, "there is no such scan; upload it, then repeat"});
}

absl::Status NotToBeChanged() {
  return absl::FailedPreconditionError("the job is finished or was removed");
}

}  // namespace

void JobStore::Report(const std::string& line) const {
  if (settings_.report) settings_.report(line);
}

void JobStore::ReportDamaged(JobTables* tables) {
  for (const std::string& id : tables->TakeDamaged()) {
    Report(absl::StrCat("the record of job ", id, " is damaged; it is set aside"));
  }
}

void JobStore::LookForRoom() {
  if (room_) room_->Check().IgnoreError();
}

absl::Status JobStore::Change(JobTables* tables, const std::function<absl::Status()>& body) {
  RILIEVO_RETURN_IF_ERROR(tables->Transact(body));
  // One that stays though its row is gone is found when the store is opened again.
  RemoveUnnamed(tables, tables->TakeGone()).IgnoreError();
  return absl::OkStatus();
}

// Somebody may have stored the same bytes since they were seen to be unused.
absl::Status JobStore::RemoveUnnamed(JobTables* tables, const std::vector<std::string>& names) {
  // The parts of a large job are thousands; nobody changes anything while one of these goes.
  constexpr size_t kAtOnce = 16;
  for (size_t begin = 0; begin < names.size(); begin += kAtOnce) {
    const absl::Status removed = tables->Alone([&]() -> absl::Status {
      for (size_t i = begin; i < std::min(names.size(), begin + kAtOnce); ++i) {
        RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, tables->BytesOfBlob(names[i]));
        if (bytes < 0) RILIEVO_RETURN_IF_ERROR(blobs_->Remove(names[i]));
      }
      return absl::OkStatus();
    });
    if (!removed.ok()) return removed;
  }
  return absl::OkStatus();
}

absl::Status JobStore::Write(JobTables* tables, const std::function<absl::Status()>& body) {
  if (!room_) return Change(tables, body);
  RILIEVO_RETURN_IF_ERROR(room_->Check());
  const absl::Status written = Change(tables, body);
  room_->Note(written);
  return written;
}

absl::Status JobStore::Free(JobTables* tables, const std::function<absl::Status()>& body) {
  const absl::Status done = Change(tables, body);
  if (!absl::IsResourceExhausted(done) || !room_) return done;
  room_->Release();
  return Change(tables, body);
}

absl::Status JobStore::Adopt(JobTables* tables, const StagedBlob& staged,
                             const std::function<absl::Status()>& body) {
  const absl::Status done = Write(tables, [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(staged.Adopt(&tables->database()));
    RILIEVO_RETURN_IF_ERROR(tables->AddBlob(staged.name(), staged.bytes(), clock_.Now()));
    return body();
  });
  if (!done.ok()) RemoveUnnamed(tables, {staged.name()}).IgnoreError();
  return done;
}

absl::Status JobStore::BeginUpload(const std::string& owner, const std::string& name,
                                   int64_t bytes) {
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(const auto known, tables->FindUpload(name));
  RILIEVO_RETURN_IF_ERROR(
      MakeRoom(tables.get(), owner, bytes - (known ? known->bytes : 0), {.upload = name}));
  return Write(tables.get(), [&] { return tables->PutUpload(owner, name, bytes, clock_.Now()); });
}

absl::Status JobStore::FinishUpload(const std::string& owner, const std::string& name,
                                    int64_t bytes, const std::string& sha256,
                                    UploadWriter* writer) {
  const auto take = [&](const StagedBlob& staged) {
    const auto tables = tables_->Take();
    return Adopt(tables.get(), staged, [&]() -> absl::Status {
      RILIEVO_RETURN_IF_ERROR(tables->DropUpload(name));
      return tables->AddScan(owner, sha256, clock_.Now());
    });
  };
  const absl::Status done = writer->Finish(bytes, sha256, take);
  if (!absl::IsDataLoss(done)) return done;
  const auto tables = tables_->Take();
  Free(tables.get(), [&] { return tables->DropUpload(name); }).IgnoreError();
  return done;
}

absl::Status JobStore::AddScan(const std::string& owner, const std::string& scan) {
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, blobs_->BytesOf(scan));
  return Write(tables.get(), [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(tables->AddBlob(scan, bytes, clock_.Now()));
    return tables->AddScan(owner, scan, clock_.Now());
  });
}

absl::StatusOr<int64_t> JobStore::BytesOfScan(const std::string& owner, const std::string& scan) {
  const auto tables = tables_->Take();
  return BytesOfScan(tables.get(), owner, scan);
}

absl::StatusOr<int64_t> JobStore::BytesOfScan(JobTables* tables, const std::string& owner,
                                              const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(const bool owned, tables->HasScan(owner, scan));
  if (!owned) return NoSuchScan();
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, tables->BytesOfBlob(scan));
  const absl::StatusOr<int64_t> stored = blobs_->BytesOf(scan);
  if (stored.ok() ? *stored == bytes : !absl::IsNotFound(stored.status())) return stored;
  Report(absl::StrCat("scan ", scan, " is lost or cut; it is forgotten until it is sent again"));
  RILIEVO_RETURN_IF_ERROR(Free(tables, [&] { return tables->ForgetScan(scan); }));
  return NoSuchScan();
}

absl::Status JobStore::RemoveScan(const std::string& owner, const std::string& scan) {
  const auto tables = tables_->Take();
  bool found = false;
  const absl::Status dropped = Free(tables.get(), [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(found, tables->DropScan(owner, scan));
    return absl::OkStatus();
  });
  if (!dropped.ok()) return dropped;
  return found ? absl::OkStatus() : NoSuchScan();
}

absl::Status JobStore::SetScanAside(const std::string& scan) {
  const auto tables = tables_->Take();
  Report(absl::StrCat("scan ", scan, " is damaged; it is set aside"));
  RILIEVO_RETURN_IF_ERROR(blobs_->SetAside(scan));
  return Free(tables.get(), [&] { return tables->ForgetScan(scan); });
}

absl::StatusOr<StoredJob> JobStore::Insert(const StoredJob& job) {
  for (;;) {
    auto inserted = TryToInsert(job);
    if (!absl::IsAborted(inserted.status())) return inserted;
  }
}

absl::StatusOr<StoredJob> JobStore::TryToInsert(StoredJob stored) {
  RILIEVO_ASSIGN_OR_RETURN(const auto mesh, TakeControlMesh(*blobs_, &stored));
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(auto known, tables->Find(stored.owner, stored.job.request_id()));
  ReportDamaged(tables.get());
  if (known) return *std::move(known);
  RILIEVO_RETURN_IF_ERROR(BytesOfScan(tables.get(), stored.owner, stored.job.scan_id()).status());
  RILIEVO_RETURN_IF_ERROR(MakeRoom(
      tables.get(), stored.owner, kJobRecordBytes + (mesh ? mesh->bytes() : 0) + stored.parts_bytes,
      {.scan = stored.job.scan_id()}));
  const auto insert = [&]() -> absl::Status {
    // Another server may have taken it to make room.
    RILIEVO_ASSIGN_OR_RETURN(const bool owned, tables->HasScan(stored.owner, stored.job.scan_id()));
    if (!owned) return NoSuchScan();
    RILIEVO_RETURN_IF_ERROR(tables->Insert(stored, /*end_ms=*/0, clock_.Now()));
    if (!shared_) return absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(JobQueue(&tables->database()).Insert(stored));
    if (stored.parts_bytes == 0) return absl::OkStatus();
    // So much is worth a second look, now that nobody else takes any.
    RILIEVO_ASSIGN_OR_RETURN(const bool fits, HasRoom(tables.get(), stored.owner, 0));
    return fits ? absl::OkStatus() : absl::AbortedError("others have taken the room meanwhile");
  };
  const absl::Status inserted =
      mesh ? Adopt(tables.get(), *mesh, insert) : Write(tables.get(), insert);
  if (!absl::IsAlreadyExists(inserted)) {
    RILIEVO_RETURN_IF_ERROR(inserted);
    return stored;
  }
  // Another server was quicker.
  RILIEVO_ASSIGN_OR_RETURN(known, tables->Find(stored.owner, stored.job.request_id()));
  if (!known) return inserted;
  return *std::move(known);
}

absl::StatusOr<StoredJob> JobStore::Get(const std::string& owner, const std::string& job_id) {
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(auto stored, tables->Find(job_id));
  ReportDamaged(tables.get());
  if (stored && stored->owner == owner) return *std::move(stored);
  if (stored) {
    ++foreign_requests_;
    return NoSuchJob();
  }
  RILIEVO_ASSIGN_OR_RETURN(const bool damaged, tables->IsDamaged(owner, job_id));
  if (!damaged) return NoSuchJob();
  return StatusOf({ErrorCause::kJobDamaged,
                   "what was kept of this job is damaged; delete it, and create it again"});
}

absl::StatusOr<std::optional<StoredJob>> JobStore::Find(const std::string& owner,
                                                        const std::string& request_id) {
  const auto tables = tables_->Take();
  auto found = tables->Find(owner, request_id);
  ReportDamaged(tables.get());
  return found;
}

absl::StatusOr<std::vector<v1::Job>> JobStore::List(const std::string& owner, int limit,
                                                    int64_t* before) {
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(auto stored, tables->List(owner, limit, before));
  ReportDamaged(tables.get());
  std::vector<v1::Job> jobs;
  jobs.reserve(stored.size());
  for (StoredJob& one : stored) jobs.push_back(std::move(one.job));
  return jobs;
}

absl::Status JobStore::ChangeJob(JobTables* tables, const StoredJob& stored) {
  const std::string& id = stored.job.job_id();
  JobQueue queue(&tables->database());
  if (shared_) RILIEVO_RETURN_IF_ERROR(queue.Lock(id));
  RILIEVO_ASSIGN_OR_RETURN(const bool changed, tables->Update(stored, clock_.Now()));
  if (!changed) return NotToBeChanged();
  return shared_ && IsFinished(stored.job.state()) ? queue.Remove(id) : absl::OkStatus();
}

absl::Status JobStore::Update(const StoredJob& stored) {
  const auto tables = tables_->Take();
  const auto update = [&] { return ChangeJob(tables.get(), stored); };
  // Its row alone changes: whoever has it locked is the only one to change it.
  if (shared_ && !IsFinished(stored.job.state())) {
    return tables->database().TransactBesideOthers(update);
  }
  // What is cancelled gives room, and must be possible without any.
  return stored.job.state() == v1::JOB_STATE_CANCELLED ? Free(tables.get(), update)
                                                       : Write(tables.get(), update);
}

absl::Status JobStore::Finish(StoredJob stored, const std::vector<std::vector<uint8_t>>& surface) {
  if (room_) RILIEVO_RETURN_IF_ERROR(room_->Check());
  const auto staged = blobs_->Stage(surface);
  if (room_) room_->Note(staged.status());
  RILIEVO_RETURN_IF_ERROR(staged.status());
  stored.surface = (*staged)->name();
  const auto tables = tables_->Take();
  return Adopt(tables.get(), **staged, [&] { return ChangeJob(tables.get(), stored); });
}

absl::Status JobStore::Remove(const std::string& owner, const std::string& job_id) {
  const auto tables = tables_->Take();
  bool found = false;
  const absl::Status removed = Free(tables.get(), [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const bool damaged, tables->IsDamaged(owner, job_id));
    if (damaged) RILIEVO_RETURN_IF_ERROR(tables->ForgetDamaged(job_id));
    RILIEVO_ASSIGN_OR_RETURN(found, tables->Remove(job_id, /*its_scan=*/true));
    found = found || damaged;
    return absl::OkStatus();
  });
  if (!removed.ok()) return removed;
  return found ? absl::OkStatus() : NoSuchJob();
}

absl::StatusOr<std::vector<StoredJob>> JobStore::Unfinished() {
  const auto tables = tables_->Take();
  auto jobs = tables->Unfinished();
  ReportDamaged(tables.get());
  return jobs;
}

}  // namespace rilievo
