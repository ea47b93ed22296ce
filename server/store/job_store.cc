#include "server/store/job_store.h"

#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/content_name.h"
#include "server/store/folder.h"

namespace rilievo {
namespace {

constexpr int kSchemaVersion = 2;
// `number` only grows: the order of creation. `end_ms` is 0 while the job is not finished.
constexpr char kSchema[] = R"(
  CREATE TABLE jobs(
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    job_id BLOB NOT NULL UNIQUE,
    owner BLOB NOT NULL,
    request_id BLOB NOT NULL,
    client BLOB NOT NULL,
    scan BLOB NOT NULL,
    surface BLOB NOT NULL,
    end_ms INTEGER NOT NULL,
    header BLOB NOT NULL,
    job BLOB NOT NULL,
    UNIQUE(owner, request_id));
  CREATE INDEX jobs_by_end ON jobs(end_ms, number);
  CREATE TABLE scans(owner BLOB NOT NULL, scan BLOB NOT NULL, PRIMARY KEY(owner, scan)) WITHOUT ROWID;
  CREATE INDEX scans_by_name ON scans(scan))";
// Version 1 had no table of scans: whoever named one could use it. Whoever made a job of it goes on
// using it, whether sent by the same owner or not; nobody can tell that any more.
constexpr char kFromVersion1[] = R"(
  CREATE TABLE scans(owner BLOB NOT NULL, scan BLOB NOT NULL, PRIMARY KEY(owner, scan)) WITHOUT ROWID;
  CREATE INDEX scans_by_name ON scans(scan);
  INSERT OR IGNORE INTO scans SELECT owner, scan FROM jobs)";

constexpr char kColumns[] = "owner, client, surface, header, job";

int64_t EndMilliseconds(const v1::Job& job) {
  if (!IsFinished(job.state())) return 0;
  return job.end_time().seconds() * 1000 + job.end_time().nanos() / 1'000'000;
}

// Of a row of kColumns.
absl::StatusOr<StoredJob> Decode(const Query& row) {
  StoredJob stored;
  stored.owner = row.Bytes(0);
  stored.client = row.Bytes(1);
  stored.surface = row.Bytes(2);
  if (!stored.header.ParseFromString(row.Bytes(3)) || !stored.job.ParseFromString(row.Bytes(4))) {
    return absl::InternalError("a job of the store is damaged");
  }
  return stored;
}

absl::Status NoSuchJob() {
  return StatusOf({ErrorCause::kJobNotFound, "there is no such job; it may have been removed"});
}

}  // namespace

absl::StatusOr<std::unique_ptr<JobStore>> JobStore::Open(const std::string& folder) {
  RILIEVO_RETURN_IF_ERROR(MakeFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor lock, LockFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(Database database, Database::Open(folder + "/jobs.db", kSchemaVersion,
                                                             kSchema, kFromVersion1));
  RILIEVO_ASSIGN_OR_RETURN(BlobFolder blobs, BlobFolder::Open(folder + "/blobs"));
  RILIEVO_ASSIGN_OR_RETURN(auto uploads, PartialUploads::Open(folder + "/uploads"));
  RILIEVO_RETURN_IF_ERROR(SyncFolder(folder));
  return std::unique_ptr<JobStore>(
      new JobStore(std::move(lock), std::move(database), std::move(blobs), std::move(uploads)));
}

absl::StatusOr<StoredJob> JobStore::Insert(const StoredJob& stored) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(auto known, FindLocked(stored.owner, stored.job.request_id()));
  if (known) return *std::move(known);
  RILIEVO_RETURN_IF_ERROR(ReadScanLocked(stored.owner, stored.job.scan_id()).status());
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_.Prepare("INSERT INTO jobs(job_id, owner, request_id, client, scan, surface, end_ms,"
                        " header, job) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)"));
  query.Bind(stored.job.job_id()).Bind(stored.owner).Bind(stored.job.request_id());
  query.Bind(stored.client).Bind(stored.job.scan_id()).Bind(stored.surface);
  query.Bind(EndMilliseconds(stored.job));
  query.Bind(stored.header.SerializeAsString()).Bind(stored.job.SerializeAsString());
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return stored;
}

absl::Status JobStore::AddScan(const std::string& owner, const std::string& scan) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("INSERT OR IGNORE INTO scans VALUES(?, ?)"));
  return query.Bind(owner).Bind(scan).Run();
}

absl::StatusOr<FileDescriptor> JobStore::ReadScan(const std::string& owner,
                                                  const std::string& scan) {
  const std::lock_guard lock(mutex_);
  return ReadScanLocked(owner, scan);
}

absl::StatusOr<FileDescriptor> JobStore::ReadScanLocked(const std::string& owner,
                                                        const std::string& scan) {
  const absl::Status none =
      StatusOf({ErrorCause::kScanNotFound, "there is no such scan; upload it, then repeat"});
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT 1 FROM scans WHERE owner = ? AND scan = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool owned, query.Bind(owner).Bind(scan).Step());
  if (!owned) return none;
  absl::StatusOr<FileDescriptor> file = blobs_.Read(scan);
  if (absl::IsNotFound(file.status())) return none;
  return file;
}

absl::Status JobStore::ForgetScans(const std::vector<std::string>& blobs) {
  for (const std::string& blob : blobs) {
    RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare("DELETE FROM scans WHERE scan = ?"));
    RILIEVO_RETURN_IF_ERROR(query.Bind(blob).Run());
  }
  return absl::OkStatus();
}

absl::Status JobStore::RemoveBlobs(const std::vector<std::string>& blobs) {
  if (blobs.empty()) return absl::OkStatus();
  // One transaction, as each is synced to disk. A file without its row goes the next time; a row
  // without its file would give the scan back to its owner when somebody else sends it.
  RILIEVO_RETURN_IF_ERROR(database_.Execute("BEGIN"));
  absl::Status forgotten = ForgetScans(blobs);
  if (forgotten.ok()) forgotten = database_.Execute("COMMIT");
  if (!forgotten.ok()) {
    // Says an error where the failure has ended the transaction already.
    database_.Execute("ROLLBACK").IgnoreError();
    return forgotten;
  }
  for (const std::string& blob : blobs) RILIEVO_RETURN_IF_ERROR(blobs_.Remove(blob));
  return absl::OkStatus();
}

absl::StatusOr<StoredJob> JobStore::Get(const std::string& owner, const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_.Prepare(absl::StrCat("SELECT ", kColumns, " FROM jobs WHERE job_id = ?").c_str()));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  if (!found) return NoSuchJob();
  RILIEVO_ASSIGN_OR_RETURN(StoredJob stored, Decode(query));
  if (stored.owner == owner) return stored;
  ++foreign_requests_;
  return NoSuchJob();
}

absl::StatusOr<std::optional<StoredJob>> JobStore::Find(const std::string& owner,
                                                        const std::string& request_id) {
  const std::lock_guard lock(mutex_);
  return FindLocked(owner, request_id);
}

absl::StatusOr<std::optional<StoredJob>> JobStore::FindLocked(const std::string& owner,
                                                              const std::string& request_id) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare(absl::StrCat("SELECT ", kColumns,
                                                  " FROM jobs WHERE owner = ? AND request_id = ?")
                                         .c_str()));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(owner).Bind(request_id).Step());
  if (!found) return std::nullopt;
  return Decode(query);
}

absl::StatusOr<std::vector<v1::Job>> JobStore::List(const std::string& owner, int limit,
                                                    int64_t* before) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("SELECT number, job FROM jobs WHERE owner = ? AND"
                                     " (?2 = 0 OR number < ?2) ORDER BY number DESC LIMIT ?3"));
  query.Bind(owner).Bind(*before).Bind(limit + 1);
  *before = 0;
  std::vector<v1::Job> jobs;
  int64_t last = 0;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return jobs;
    if (jobs.size() == static_cast<size_t>(limit)) {
      *before = last;
      return jobs;
    }
    last = query.Integer(0);
    if (!jobs.emplace_back().ParseFromString(query.Bytes(1))) {
      return absl::InternalError("a job of the store is damaged");
    }
  }
}

absl::Status JobStore::Update(const StoredJob& stored) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("UPDATE jobs SET surface = ?, end_ms = ?, job = ?"
                                             " WHERE job_id = ? AND end_ms = 0"));
  query.Bind(stored.surface).Bind(EndMilliseconds(stored.job));
  query.Bind(stored.job.SerializeAsString()).Bind(stored.job.job_id());
  RILIEVO_RETURN_IF_ERROR(query.Run());
  if (database_.Changes() == 1) return absl::OkStatus();
  return absl::FailedPreconditionError("the job is finished or was removed");
}

absl::Status JobStore::Finish(StoredJob stored, const std::vector<std::vector<uint8_t>>& surface) {
  Sha256 hash;
  for (const auto& part : surface) AddBytes(part.data(), part.size(), &hash);
  stored.surface = ContentName(hash);
  {
    const std::lock_guard lock(mutex_);
    coming_.insert(stored.surface);
  }
  absl::Status status = blobs_.Put(surface).status();
  if (status.ok()) status = Update(stored);
  const std::lock_guard lock(mutex_);
  coming_.erase(coming_.find(stored.surface));
  return status;
}

absl::Status JobStore::Remove(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare("DELETE FROM jobs WHERE job_id = ?"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(job_id).Run());
  return database_.Changes() == 1 ? absl::OkStatus() : NoSuchJob();
}

absl::StatusOr<std::vector<StoredJob>> JobStore::Unfinished() {
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare(absl::StrCat("SELECT ", kColumns,
                                                  " FROM jobs WHERE end_ms = 0 ORDER BY number")
                                         .c_str()));
  std::vector<StoredJob> jobs;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return jobs;
    RILIEVO_ASSIGN_OR_RETURN(StoredJob stored, Decode(query));
    jobs.push_back(std::move(stored));
  }
}

absl::StatusOr<int64_t> JobStore::RemoveUnusedBlobs(int64_t older_than_ms) {
  std::set<std::string> used;
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare("SELECT scan, surface FROM jobs"));
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) break;
    used.insert(query.Bytes(0));
    used.insert(query.Bytes(1));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, blobs_.List());
  int64_t left = 0;
  std::vector<std::string> unused;
  for (const FileEntry& file : files) {
    if (file.modified_ms < older_than_ms && !used.contains(file.name) &&
        !coming_.contains(file.name)) {
      unused.push_back(file.name);
    } else {
      left += file.bytes;
    }
  }
  RILIEVO_RETURN_IF_ERROR(RemoveBlobs(unused));
  return left;
}

// Bytes that it gave back.
absl::StatusOr<int64_t> JobStore::RemoveIfUnused(const std::string& blob) {
  if (coming_.contains(blob)) return 0;
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("SELECT 1 FROM jobs WHERE scan = ?1 OR surface = ?1 LIMIT 1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool used, query.Bind(blob).Step());
  if (used) return 0;
  const auto file = blobs_.Read(blob);
  if (!file.ok()) return 0;
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, file->Size());
  RILIEVO_RETURN_IF_ERROR(RemoveBlobs({blob}));
  return bytes;
}

// Bytes that it gave back; NOT_FOUND when no job is finished.
absl::StatusOr<int64_t> JobStore::RemoveOldestFinished() {
  std::string blobs[2];
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database_.Prepare("DELETE FROM jobs WHERE number = (SELECT number FROM jobs"
                                       " WHERE end_ms > 0 ORDER BY end_ms, number LIMIT 1)"
                                       " RETURNING scan, surface"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Step());
    if (!found) return NoSuchJob();
    blobs[0] = query.Bytes(0);
    blobs[1] = query.Bytes(1);
    RILIEVO_RETURN_IF_ERROR(query.Run());
  }
  RILIEVO_ASSIGN_OR_RETURN(const int64_t scan_bytes, RemoveIfUnused(blobs[0]));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t surface_bytes, RemoveIfUnused(blobs[1]));
  return scan_bytes + surface_bytes;
}

absl::StatusOr<int64_t> JobStore::Clean(const Retention& retention, int64_t now_ms) {
  const int64_t oldest = now_ms - retention.age_ms;
  RILIEVO_ASSIGN_OR_RETURN(const int64_t uploads, uploads_->RemoveOlderThan(oldest));
  const std::lock_guard lock(mutex_);
  {
    RILIEVO_ASSIGN_OR_RETURN(Query query,
                             database_.Prepare("DELETE FROM jobs WHERE end_ms > 0 AND end_ms < ?"));
    RILIEVO_RETURN_IF_ERROR(query.Bind(oldest).Run());
  }
  RILIEVO_ASSIGN_OR_RETURN(int64_t stored, RemoveUnusedBlobs(oldest));
  while (stored + uploads > retention.bytes) {
    const absl::StatusOr<int64_t> freed = RemoveOldestFinished();
    if (absl::IsNotFound(freed.status())) break;
    RILIEVO_RETURN_IF_ERROR(freed.status());
    stored -= *freed;
  }
  return stored + uploads;
}

}  // namespace rilievo
