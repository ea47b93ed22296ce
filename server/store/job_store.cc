#include "server/store/job_store.h"

#include <sys/stat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/content_name.h"
#include "server/store/control_mesh_blob.h"
#include "server/store/folder.h"
#include "server/store/store_tables.h"

namespace rilievo {
namespace {

constexpr char kStoreTime[] = "store_ms", kWallTime[] = "wall_ms";

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

absl::StatusOr<std::unique_ptr<JobStore>> JobStore::Open(const std::string& folder,
                                                         StoreSettings settings) {
  RILIEVO_RETURN_IF_ERROR(MakeFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor lock, LockFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(BlobFolder blobs, BlobFolder::Open(folder + "/blobs"));
  RILIEVO_ASSIGN_OR_RETURN(JobTables tables, OpenTables(folder, blobs));
  RILIEVO_ASSIGN_OR_RETURN(auto uploads, PartialUploads::Open(folder + "/uploads"));
  RILIEVO_RETURN_IF_ERROR(SyncFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t store_ms, tables.State(kStoreTime));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t wall_ms, tables.State(kWallTime));
  const StoreClock clock(store_ms, wall_ms, settings.clock);
  std::unique_ptr<JobStore> store(new JobStore(folder, std::move(lock), std::move(tables),
                                               std::move(blobs), std::move(uploads),
                                               std::move(settings), clock));
  RILIEVO_RETURN_IF_ERROR(store->Reconcile());
  return store;
}

JobStore::JobStore(const std::string& folder, FileDescriptor lock, JobTables tables,
                   BlobFolder blobs, std::unique_ptr<PartialUploads> uploads,
                   StoreSettings settings, const StoreClock& clock)
    : folder_(folder),
      lock_(std::move(lock)),
      settings_(std::move(settings)),
      clock_(clock),
      tables_(std::move(tables)),
      blobs_(std::move(blobs)),
      uploads_(std::move(uploads)),
      room_(folder) {}

JobStore::~JobStore() {
  const std::lock_guard lock(mutex_);
  Change([&] { return KeepTime(); }).IgnoreError();
  tables_.database().Shrink().IgnoreError();
}

absl::Status JobStore::KeepTime() {
  RILIEVO_RETURN_IF_ERROR(tables_.SetState(kStoreTime, clock_.Now()));
  return tables_.SetState(kWallTime, clock_.Wall());
}

absl::Status JobStore::Reconcile() {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, blobs_.List());
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> uploads, uploads_->List());
  const std::lock_guard lock(mutex_);
  struct stat rights {};
  if (stat(folder_.c_str(), &rights) == 0 && (rights.st_mode & 077) != 0) {
    Report(absl::StrCat(folder_, " is open to others than its owner; chmod 700 it"));
  }
  // A full disk is no reason not to start: what is stored can be read and removed.
  const absl::Status done = Change([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(KeepTime());
    for (const FileEntry& file : files) {
      RILIEVO_ASSIGN_OR_RETURN(const int64_t known, tables_.BytesOfBlob(file.name));
      if (known >= 0) continue;
      RILIEVO_RETURN_IF_ERROR(tables_.AddBlob(file.name, file.bytes, clock_.Now()));
    }
    std::set<std::string> there;
    for (const FileEntry& file : uploads) {
      there.insert(file.name);
      RILIEVO_ASSIGN_OR_RETURN(const auto known, tables_.FindUpload(file.name));
      if (known) continue;
      RILIEVO_RETURN_IF_ERROR(tables_.PutUpload("", file.name, file.bytes, clock_.Now()));
    }
    RILIEVO_ASSIGN_OR_RETURN(const auto announced, tables_.UploadsBefore(INT64_MAX));
    for (const auto& upload : announced) {
      if (!there.contains(upload.name)) RILIEVO_RETURN_IF_ERROR(tables_.DropUpload(upload.name));
    }
    return absl::OkStatus();
  });
  room_.Note(done);
  return absl::IsResourceExhausted(done) ? absl::OkStatus() : done;
}

void JobStore::Report(const std::string& line) const {
  if (settings_.report) settings_.report(line);
}

void JobStore::ReportDamaged() {
  for (const std::string& id : tables_.TakeDamaged()) {
    Report(absl::StrCat("the record of job ", id, " is damaged; it is set aside"));
  }
}

absl::Status JobStore::Change(const std::function<absl::Status()>& body) {
  RILIEVO_RETURN_IF_ERROR(tables_.Transact(body));
  // A file that stays though its row is gone is found when the store is opened again.
  for (const std::string& blob : tables_.TakeGone()) blobs_.Remove(blob).IgnoreError();
  return absl::OkStatus();
}

absl::Status JobStore::Write(const std::function<absl::Status()>& body) {
  RILIEVO_RETURN_IF_ERROR(room_.Check());
  const absl::Status written = Change(body);
  room_.Note(written);
  return written;
}

absl::Status JobStore::Free(const std::function<absl::Status()>& body) {
  const absl::Status done = Change(body);
  if (!absl::IsResourceExhausted(done)) return done;
  room_.Release();
  return Change(body);
}

absl::Status JobStore::Adopt(const std::string& path, const FileDescriptor& file,
                             const std::string& name, const std::function<absl::Status()>& body) {
  const absl::Status done = Write([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, file.Size());
    RILIEVO_RETURN_IF_ERROR(blobs_.Adopt(path, file, name));
    RILIEVO_RETURN_IF_ERROR(tables_.AddBlob(name, bytes, clock_.Now()));
    return body();
  });
  if (!done.ok() && tables_.BytesOfBlob(name).value_or(0) < 0) blobs_.Remove(name).IgnoreError();
  return done;
}

absl::Status JobStore::BeginUpload(const std::string& owner, const std::string& name,
                                   int64_t bytes) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(const auto known, tables_.FindUpload(name));
  RILIEVO_RETURN_IF_ERROR(MakeRoom(owner, bytes - (known ? known->bytes : 0), name));
  return Write([&] { return tables_.PutUpload(owner, name, bytes, clock_.Now()); });
}

absl::Status JobStore::FinishUpload(const std::string& owner, const std::string& name,
                                    int64_t bytes, const std::string& sha256,
                                    PartialUploads::Writer* writer) {
  const auto take = [&](const std::string& path, const FileDescriptor& file) {
    const std::lock_guard lock(mutex_);
    return Adopt(path, file, sha256, [&]() -> absl::Status {
      RILIEVO_RETURN_IF_ERROR(tables_.DropUpload(name));
      return tables_.AddScan(owner, sha256, clock_.Now());
    });
  };
  const absl::Status done = writer->Finish(bytes, sha256, take);
  if (!absl::IsDataLoss(done)) return done;
  const std::lock_guard lock(mutex_);
  Free([&] { return tables_.DropUpload(name); }).IgnoreError();
  return done;
}

absl::Status JobStore::AddScan(const std::string& owner, const std::string& scan) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor file, blobs_.Read(scan));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, file.Size());
  return Write([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(tables_.AddBlob(scan, bytes, clock_.Now()));
    return tables_.AddScan(owner, scan, clock_.Now());
  });
}

absl::StatusOr<FileDescriptor> JobStore::ReadScan(const std::string& owner,
                                                  const std::string& scan) {
  const std::lock_guard lock(mutex_);
  return ReadScanLocked(owner, scan);
}

absl::StatusOr<FileDescriptor> JobStore::ReadScanLocked(const std::string& owner,
                                                        const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(const bool owned, tables_.HasScan(owner, scan));
  if (!owned) return NoSuchScan();
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, tables_.BytesOfBlob(scan));
  absl::StatusOr<FileDescriptor> file = blobs_.Read(scan);
  if (file.ok() ? file->Size().value_or(-1) == bytes : !absl::IsNotFound(file.status())) {
    return file;
  }
  Report(absl::StrCat("scan ", scan, " is lost or cut; it is forgotten until it is sent again"));
  RILIEVO_RETURN_IF_ERROR(Free([&] { return tables_.ForgetScan(scan); }));
  return NoSuchScan();
}

absl::Status JobStore::RemoveScan(const std::string& owner, const std::string& scan) {
  const std::lock_guard lock(mutex_);
  bool found = false;
  const absl::Status dropped = Free([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(found, tables_.DropScan(owner, scan));
    return absl::OkStatus();
  });
  if (!dropped.ok()) return dropped;
  return found ? absl::OkStatus() : NoSuchScan();
}

absl::Status JobStore::SetScanAside(const std::string& scan) {
  const std::lock_guard lock(mutex_);
  Report(absl::StrCat("scan ", scan, " is damaged; it is set aside"));
  RILIEVO_RETURN_IF_ERROR(blobs_.SetAside(scan));
  return Free([&] { return tables_.ForgetScan(scan); });
}

absl::StatusOr<StoredJob> JobStore::Insert(StoredJob stored) {
  RILIEVO_ASSIGN_OR_RETURN(const auto mesh, TakeControlMesh(blobs_, &stored));
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(auto known, tables_.Find(stored.owner, stored.job.request_id()));
  ReportDamaged();
  if (known) return *std::move(known);
  RILIEVO_RETURN_IF_ERROR(ReadScanLocked(stored.owner, stored.job.scan_id()).status());
  RILIEVO_RETURN_IF_ERROR(MakeRoom(stored.owner, kJobRecordBytes + (mesh ? mesh->bytes() : 0), ""));
  // Making room may have taken it.
  RILIEVO_RETURN_IF_ERROR(ReadScanLocked(stored.owner, stored.job.scan_id()).status());
  const auto insert = [&] { return tables_.Insert(stored, /*end_ms=*/0, clock_.Now()); };
  RILIEVO_RETURN_IF_ERROR(mesh ? Adopt(mesh->path(), mesh->file(), mesh->name(), insert)
                               : Write(insert));
  return stored;
}

absl::StatusOr<StoredJob> JobStore::Get(const std::string& owner, const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(auto stored, tables_.Find(job_id));
  ReportDamaged();
  if (stored && stored->owner == owner) return *std::move(stored);
  if (stored) {
    ++foreign_requests_;
    return NoSuchJob();
  }
  RILIEVO_ASSIGN_OR_RETURN(const bool damaged, tables_.IsDamaged(owner, job_id));
  if (!damaged) return NoSuchJob();
  return StatusOf({ErrorCause::kJobDamaged,
                   "what was kept of this job is damaged; delete it, and create it again"});
}

absl::StatusOr<std::optional<StoredJob>> JobStore::Find(const std::string& owner,
                                                        const std::string& request_id) {
  const std::lock_guard lock(mutex_);
  auto found = tables_.Find(owner, request_id);
  ReportDamaged();
  return found;
}

absl::StatusOr<std::vector<v1::Job>> JobStore::List(const std::string& owner, int limit,
                                                    int64_t* before) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(auto stored, tables_.List(owner, limit, before));
  ReportDamaged();
  std::vector<v1::Job> jobs;
  jobs.reserve(stored.size());
  for (StoredJob& one : stored) jobs.push_back(std::move(one.job));
  return jobs;
}

absl::Status JobStore::Update(const StoredJob& stored) {
  const std::lock_guard lock(mutex_);
  const auto update = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const bool changed, tables_.Update(stored, clock_.Now()));
    return changed ? absl::OkStatus() : NotToBeChanged();
  };
  // What is cancelled gives room, and must be possible without any.
  return stored.job.state() == v1::JOB_STATE_CANCELLED ? Free(update) : Write(update);
}

absl::Status JobStore::Finish(StoredJob stored, const std::vector<std::vector<uint8_t>>& surface) {
  RILIEVO_RETURN_IF_ERROR(room_.Check());
  auto staged = blobs_.Stage(surface);
  room_.Note(staged.status());
  RILIEVO_RETURN_IF_ERROR(staged.status());
  stored.surface = staged->name();
  const std::lock_guard lock(mutex_);
  return Adopt(staged->path(), staged->file(), staged->name(), [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const bool changed, tables_.Update(stored, clock_.Now()));
    return changed ? absl::OkStatus() : NotToBeChanged();
  });
}

absl::Status JobStore::Remove(const std::string& owner, const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  bool found = false;
  const absl::Status removed = Free([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const bool damaged, tables_.IsDamaged(owner, job_id));
    if (damaged) RILIEVO_RETURN_IF_ERROR(tables_.ForgetDamaged(job_id));
    RILIEVO_ASSIGN_OR_RETURN(found, tables_.Remove(job_id, /*its_scan=*/true));
    found = found || damaged;
    return absl::OkStatus();
  });
  if (!removed.ok()) return removed;
  return found ? absl::OkStatus() : NoSuchJob();
}

absl::StatusOr<std::vector<StoredJob>> JobStore::Unfinished() {
  const std::lock_guard lock(mutex_);
  auto jobs = tables_.Unfinished();
  ReportDamaged();
  return jobs;
}

}  // namespace rilievo
