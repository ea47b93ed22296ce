#include "server/store/job_tables.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// `number` grows over all owners, `turn` over the jobs of one. `end_ms` is 0 while a job is not
// finished. Times are of the store's clock.
constexpr char kSchema[] = R"(
  CREATE TABLE jobs(
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    job_id BLOB NOT NULL UNIQUE,
    owner BLOB NOT NULL,
    turn INTEGER NOT NULL,
    request_id BLOB NOT NULL,
    client BLOB NOT NULL,
    scan BLOB NOT NULL,
    mesh BLOB NOT NULL,
    surface BLOB NOT NULL,
    end_ms INTEGER NOT NULL,
    unclean_ends INTEGER NOT NULL,
    header BLOB NOT NULL,
    job BLOB NOT NULL,
    checksum INTEGER NOT NULL,
    UNIQUE(owner, request_id),
    UNIQUE(owner, turn));
  CREATE INDEX jobs_by_end ON jobs(end_ms);
  CREATE INDEX jobs_by_owner_and_end ON jobs(owner, end_ms, number);
  CREATE INDEX jobs_by_scan ON jobs(scan, owner);
  CREATE TABLE damaged(
    job_id BLOB PRIMARY KEY, owner BLOB NOT NULL, scan BLOB NOT NULL, mesh BLOB NOT NULL,
    surface BLOB NOT NULL, since_ms INTEGER NOT NULL, header BLOB NOT NULL, job BLOB NOT NULL);
  CREATE TABLE scans(owner BLOB NOT NULL, scan BLOB NOT NULL, since_ms INTEGER NOT NULL,
    PRIMARY KEY(owner, scan)) WITHOUT ROWID;
  CREATE INDEX scans_by_age ON scans(owner, since_ms);
  CREATE INDEX scans_by_name ON scans(scan);
  CREATE TABLE uploads(name BLOB PRIMARY KEY, owner BLOB NOT NULL, bytes INTEGER NOT NULL,
    since_ms INTEGER NOT NULL) WITHOUT ROWID;
  CREATE TABLE blobs(name BLOB PRIMARY KEY, bytes INTEGER NOT NULL, since_ms INTEGER NOT NULL)
    WITHOUT ROWID;
  CREATE TABLE uses(blob BLOB NOT NULL, owner BLOB NOT NULL, count INTEGER NOT NULL,
    PRIMARY KEY(blob, owner)) WITHOUT ROWID;
  CREATE TABLE owners(owner BLOB PRIMARY KEY, bytes INTEGER NOT NULL) WITHOUT ROWID;
  CREATE TABLE state(name BLOB PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID)";

constexpr char kColumns[] =
    "number, job_id, owner, client, surface, mesh, unclean_ends, end_ms, header, job, checksum";

absl::StatusOr<StoredJob> Decode(const Query& row) {
  StoredJob stored;
  stored.owner = row.Bytes(2);
  stored.client = row.Bytes(3);
  stored.surface = row.Bytes(4);
  stored.mesh = row.Bytes(5);
  stored.unclean_ends = static_cast<int>(row.Integer(6));
  RILIEVO_RETURN_IF_ERROR(
      DecodeJob({row.Bytes(8), row.Bytes(9), row.Integer(7), row.Integer(10)}, &stored));
  if (stored.job.job_id() != row.Bytes(1)) return absl::DataLossError("another job's record");
  return stored;
}

}  // namespace

absl::Status JobTables::Make(Database* database) { return database->Make(kSchemaVersion, kSchema); }

absl::Status JobTables::Transact(const std::function<absl::Status()>& body) {
  gone_.clear();
  const absl::Status done = database_.Transact(body);
  if (!done.ok()) gone_.clear();
  return done;
}

absl::StatusOr<std::vector<std::pair<int64_t, StoredJob>>> JobTables::Read(
    const std::string& where, const std::function<void(Query*)>& bind) {
  std::vector<std::pair<int64_t, StoredJob>> jobs;
  std::vector<std::pair<int64_t, std::string>> damaged;
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database_.Prepare(absl::StrCat("SELECT ", kColumns, " FROM jobs ", where)));
    bind(&query);
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
      if (!row) break;
      absl::StatusOr<StoredJob> stored = Decode(query);
      if (stored.ok()) {
        jobs.emplace_back(query.Integer(0), *std::move(stored));
      } else {
        damaged.emplace_back(query.Integer(0), query.Bytes(1));
      }
    }
  }
  if (!damaged.empty()) RILIEVO_RETURN_IF_ERROR(SetAside(damaged));
  return jobs;
}

absl::Status JobTables::SetAside(const std::vector<std::pair<int64_t, std::string>>& rows) {
  const auto move_rows = [&]() -> absl::Status {
    for (const auto& [number, id] : rows) {
      RILIEVO_ASSIGN_OR_RETURN(
          Query keep,
          database_.Prepare("INSERT OR REPLACE INTO damaged SELECT job_id, owner, scan, mesh,"
                            " surface, (SELECT value FROM state WHERE name = CAST('store_ms' AS"
                            " BLOB)), header, job FROM jobs WHERE number = ?"));
      RILIEVO_RETURN_IF_ERROR(keep.Bind(number).Run());
      RILIEVO_ASSIGN_OR_RETURN(Query drop, database_.Prepare("DELETE FROM jobs WHERE number = ?"));
      RILIEVO_RETURN_IF_ERROR(drop.Bind(number).Run());
    }
    return Recount();
  };
  RILIEVO_RETURN_IF_ERROR(database_.Transact(move_rows));
  for (const auto& [number, id] : rows) damaged_.push_back(id);
  return absl::OkStatus();
}

absl::StatusOr<std::optional<StoredJob>> JobTables::Find(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(auto rows,
                           Read("WHERE job_id = ?", [&](Query* query) { query->Bind(job_id); }));
  if (rows.empty()) return std::nullopt;
  return std::move(rows[0].second);
}

absl::StatusOr<std::optional<StoredJob>> JobTables::Find(const std::string& owner,
                                                         const std::string& request_id) {
  RILIEVO_ASSIGN_OR_RETURN(auto rows, Read("WHERE owner = ? AND request_id = ?", [&](Query* query) {
                             query->Bind(owner).Bind(request_id);
                           }));
  if (rows.empty()) return std::nullopt;
  return std::move(rows[0].second);
}

absl::StatusOr<std::vector<StoredJob>> JobTables::List(const std::string& owner, int limit,
                                                       int64_t* before) {
  // Damaged rows leave a page short, and are not there the second time.
  std::vector<std::pair<int64_t, StoredJob>> rows;
  size_t damaged;
  do {
    damaged = damaged_.size();
    RILIEVO_ASSIGN_OR_RETURN(
        rows, Read("WHERE owner = ? AND (?2 = 0 OR turn < ?2) ORDER BY turn DESC LIMIT ?3",
                   [&](Query* query) { query->Bind(owner).Bind(*before).Bind(limit + 1); }));
  } while (damaged != damaged_.size());
  *before = 0;
  if (rows.size() > static_cast<size_t>(limit)) {
    rows.pop_back();
    RILIEVO_ASSIGN_OR_RETURN(Query turn,
                             database_.Prepare("SELECT turn FROM jobs WHERE number = ?"));
    RILIEVO_RETURN_IF_ERROR(turn.Bind(rows.back().first).Step().status());
    *before = turn.Integer(0);
  }
  std::vector<StoredJob> jobs;
  jobs.reserve(rows.size());
  for (auto& [number, stored] : rows) jobs.push_back(std::move(stored));
  return jobs;
}

absl::StatusOr<std::vector<StoredJob>> JobTables::Unfinished() {
  RILIEVO_ASSIGN_OR_RETURN(auto rows, Read("WHERE end_ms = 0 ORDER BY number", [](Query*) {}));
  std::vector<StoredJob> jobs;
  jobs.reserve(rows.size());
  for (auto& [number, stored] : rows) jobs.push_back(std::move(stored));
  return jobs;
}

absl::StatusOr<std::vector<StoredJob>> JobTables::After(int64_t* number, int limit) {
  RILIEVO_ASSIGN_OR_RETURN(Query last,
                           database_.Prepare("SELECT MAX(number) FROM (SELECT number FROM jobs"
                                             " WHERE number > ? ORDER BY number LIMIT ?)"));
  RILIEVO_RETURN_IF_ERROR(last.Bind(*number).Bind(limit).Step().status());
  const int64_t to = last.Integer(0);
  RILIEVO_RETURN_IF_ERROR(last.Run());
  RILIEVO_ASSIGN_OR_RETURN(auto rows, Read("WHERE number > ? AND number <= ? ORDER BY number",
                                           [&](Query* query) { query->Bind(*number).Bind(to); }));
  *number = to;
  std::vector<StoredJob> jobs;
  jobs.reserve(rows.size());
  for (auto& [row, stored] : rows) jobs.push_back(std::move(stored));
  return jobs;
}

absl::Status JobTables::SetAside(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT number FROM jobs WHERE job_id = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  if (!found) return absl::OkStatus();
  const int64_t number = query.Integer(0);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return SetAside({{number, job_id}});
}

absl::StatusOr<bool> JobTables::IsDamaged(const std::string& owner, const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("SELECT 1 FROM damaged WHERE owner = ? AND job_id = ?"));
  return query.Bind(owner).Bind(job_id).Step();
}

absl::Status JobTables::ForgetDamaged(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare("DELETE FROM damaged WHERE job_id = ?"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(job_id).Run());
  return Recount();
}

absl::Status JobTables::Insert(const StoredJob& stored, int64_t end_ms, int64_t now_ms) {
  const JobRow row = EncodeJob(stored, end_ms);
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_.Prepare("INSERT INTO jobs(job_id, owner, turn, request_id, client, scan, mesh,"
                        " surface, end_ms, unclean_ends, header, job, checksum)"
                        " VALUES(?1, ?2, (SELECT COALESCE(MAX(turn), 0) + 1 FROM jobs WHERE owner ="
                        " ?2), ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)"));
  query.Bind(stored.job.job_id()).Bind(stored.owner).Bind(stored.job.request_id());
  query.Bind(stored.client).Bind(stored.job.scan_id()).Bind(stored.mesh).Bind(stored.surface);
  query.Bind(end_ms).Bind(stored.unclean_ends).Bind(row.header).Bind(row.job).Bind(row.checksum);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  RILIEVO_RETURN_IF_ERROR(AddBytes(stored.owner, kJobRecordBytes));
  if (end_ms != 0) {
    return stored.surface.empty() ? absl::OkStatus() : Use(stored.owner, stored.surface);
  }
  RILIEVO_RETURN_IF_ERROR(UseInputs(stored));
  RILIEVO_ASSIGN_OR_RETURN(
      Query touch, database_.Prepare("UPDATE scans SET since_ms = ? WHERE owner = ? AND scan = ?"));
  return touch.Bind(now_ms).Bind(stored.owner).Bind(stored.job.scan_id()).Run();
}

absl::StatusOr<bool> JobTables::Update(const StoredJob& stored, int64_t now_ms) {
  const bool ends = IsFinished(stored.job.state());
  const int64_t end_ms = ends ? now_ms : 0;
  const JobRow row = EncodeJob(stored, end_ms);
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database_.Prepare("UPDATE jobs SET surface = ?, end_ms = ?, unclean_ends = ?,"
                                       " job = ?, checksum = ? WHERE job_id = ? AND end_ms = 0"));
    query.Bind(stored.surface).Bind(end_ms).Bind(stored.unclean_ends).Bind(row.job);
    query.Bind(row.checksum).Bind(stored.job.job_id());
    RILIEVO_RETURN_IF_ERROR(query.Run());
    if (database_.Changes() != 1) return false;
  }
  if (!ends) return true;
  if (!stored.surface.empty()) RILIEVO_RETURN_IF_ERROR(Use(stored.owner, stored.surface));
  RILIEVO_ASSIGN_OR_RETURN(
      Query touch, database_.Prepare("UPDATE scans SET since_ms = ? WHERE owner = ? AND scan = ?"));
  RILIEVO_RETURN_IF_ERROR(touch.Bind(now_ms).Bind(stored.owner).Bind(stored.job.scan_id()).Run());
  RILIEVO_RETURN_IF_ERROR(DropInputs(stored));
  return true;
}

absl::StatusOr<bool> JobTables::Remove(const std::string& job_id, bool its_scan) {
  StoredJob stored;
  bool finished;
  std::string scan;
  {
    RILIEVO_ASSIGN_OR_RETURN(Query query,
                             database_.Prepare("DELETE FROM jobs WHERE job_id = ?"
                                               " RETURNING owner, scan, mesh, surface, end_ms"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
    if (!found) return false;
    stored.owner = query.Bytes(0);
    scan = query.Bytes(1);
    stored.job.set_scan_id(scan);
    stored.mesh = query.Bytes(2);
    stored.surface = query.Bytes(3);
    finished = query.Integer(4) != 0;
    RILIEVO_RETURN_IF_ERROR(query.Run());
  }
  RILIEVO_RETURN_IF_ERROR(AddBytes(stored.owner, -kJobRecordBytes));
  if (!finished) RILIEVO_RETURN_IF_ERROR(DropInputs(stored));
  if (!stored.surface.empty()) RILIEVO_RETURN_IF_ERROR(Drop(stored.owner, stored.surface));
  if (!its_scan) return true;
  RILIEVO_ASSIGN_OR_RETURN(
      Query others, database_.Prepare("SELECT 1 FROM jobs WHERE scan = ? AND owner = ? LIMIT 1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool needed, others.Bind(scan).Bind(stored.owner).Step());
  if (!needed) RILIEVO_RETURN_IF_ERROR(DropScan(stored.owner, scan).status());
  return true;
}

absl::Status JobTables::AddBytes(const std::string& owner, int64_t bytes) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("INSERT INTO owners VALUES(?1, ?2) ON CONFLICT(owner) DO"
                                     " UPDATE SET bytes = bytes + ?2"));
  return query.Bind(owner).Bind(bytes).Run();
}

absl::Status JobTables::UseInputs(const StoredJob& stored) {
  RILIEVO_RETURN_IF_ERROR(Use(stored.owner, stored.job.scan_id()));
  return stored.mesh.empty() ? absl::OkStatus() : Use(stored.owner, stored.mesh);
}

absl::Status JobTables::DropInputs(const StoredJob& stored) {
  RILIEVO_RETURN_IF_ERROR(Drop(stored.owner, stored.job.scan_id()));
  return stored.mesh.empty() ? absl::OkStatus() : Drop(stored.owner, stored.mesh);
}

absl::Status JobTables::Use(const std::string& owner, const std::string& blob) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("INSERT INTO uses VALUES(?, ?, 1) ON CONFLICT(blob, owner) DO"
                                     " UPDATE SET count = count + 1 RETURNING count"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(blob).Bind(owner).Step().status());
  const bool first = query.Integer(0) == 1;
  RILIEVO_RETURN_IF_ERROR(query.Run());
  if (!first) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, BytesOfBlob(blob));
  return AddBytes(owner, std::max<int64_t>(0, bytes));
}

absl::Status JobTables::Drop(const std::string& owner, const std::string& blob) {
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database_.Prepare("UPDATE uses SET count = count - 1 WHERE blob = ? AND owner"
                                       " = ? RETURNING count"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(blob).Bind(owner).Step());
    if (!found || query.Integer(0) > 0) return found ? query.Run() : absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(query.Run());
  }
  RILIEVO_ASSIGN_OR_RETURN(Query drop,
                           database_.Prepare("DELETE FROM uses WHERE blob = ? AND owner = ?"));
  RILIEVO_RETURN_IF_ERROR(drop.Bind(blob).Bind(owner).Run());
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, BytesOfBlob(blob));
  RILIEVO_RETURN_IF_ERROR(AddBytes(owner, -std::max<int64_t>(0, bytes)));
  RILIEVO_ASSIGN_OR_RETURN(
      Query forget, database_.Prepare("DELETE FROM blobs WHERE name = ?1 AND NOT EXISTS(SELECT 1"
                                      " FROM uses WHERE blob = ?1)"));
  RILIEVO_RETURN_IF_ERROR(forget.Bind(blob).Run());
  if (database_.Changes() == 1) gone_.push_back(blob);
  return absl::OkStatus();
}

absl::Status JobTables::AddBlob(const std::string& name, int64_t bytes, int64_t now_ms) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("INSERT INTO blobs VALUES(?1, ?2, ?3) ON CONFLICT(name) DO"
                                     " UPDATE SET since_ms = ?3"));
  return query.Bind(name).Bind(bytes).Bind(now_ms).Run();
}

absl::Status JobTables::ForgetBlob(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare("DELETE FROM blobs WHERE name = ?"));
  return query.Bind(name).Run();
}

absl::StatusOr<std::vector<std::string>> JobTables::BlobNames() {
  return Names("SELECT name FROM blobs", [](Query*) {});
}

absl::StatusOr<int64_t> JobTables::BytesOfBlob(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT bytes FROM blobs WHERE name = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  return found ? query.Integer(0) : -1;
}

absl::Status JobTables::AddScan(const std::string& owner, const std::string& scan, int64_t now_ms) {
  RILIEVO_ASSIGN_OR_RETURN(const bool had, HasScan(owner, scan));
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("INSERT OR REPLACE INTO scans VALUES(?, ?, ?)"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(owner).Bind(scan).Bind(now_ms).Run());
  return had ? absl::OkStatus() : Use(owner, scan);
}

absl::StatusOr<bool> JobTables::HasScan(const std::string& owner, const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT 1 FROM scans WHERE owner = ? AND scan = ?"));
  return query.Bind(owner).Bind(scan).Step();
}

absl::StatusOr<bool> JobTables::DropScan(const std::string& owner, const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("DELETE FROM scans WHERE owner = ? AND scan = ?"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(owner).Bind(scan).Run());
  if (database_.Changes() == 0) return false;
  RILIEVO_RETURN_IF_ERROR(Drop(owner, scan));
  return true;
}

absl::Status JobTables::ForgetScan(const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(const auto owners, Names("SELECT owner FROM scans WHERE scan = ?",
                                                    [&](Query* query) { query->Bind(scan); }));
  for (const std::string& owner : owners) {
    RILIEVO_RETURN_IF_ERROR(DropScan(owner, scan).status());
  }
  return absl::OkStatus();
}

absl::Status JobTables::PutUpload(const std::string& owner, const std::string& name, int64_t bytes,
                                  int64_t now_ms) {
  RILIEVO_RETURN_IF_ERROR(DropUpload(name));
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("INSERT INTO uploads VALUES(?, ?, ?, ?)"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(name).Bind(owner).Bind(bytes).Bind(now_ms).Run());
  return AddBytes(owner, bytes);
}

absl::Status JobTables::DropUpload(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("DELETE FROM uploads WHERE name = ? RETURNING owner, bytes"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  if (!found) return absl::OkStatus();
  const std::string owner = query.Bytes(0);
  const int64_t bytes = query.Integer(1);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return AddBytes(owner, -bytes);
}

absl::StatusOr<std::optional<JobTables::Upload>> JobTables::FindUpload(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT bytes FROM uploads WHERE name = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  if (!found) return std::nullopt;
  return Upload{name, query.Integer(0)};
}

absl::StatusOr<std::vector<JobTables::Upload>> JobTables::UploadsOf(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT name, bytes FROM uploads WHERE owner = ?"
                                             " ORDER BY since_ms"));
  query.Bind(owner);
  std::vector<Upload> uploads;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return uploads;
    uploads.push_back({query.Bytes(0), query.Integer(1)});
  }
}

absl::StatusOr<std::vector<JobTables::Upload>> JobTables::UploadsBefore(int64_t since_ms) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT name, bytes FROM uploads WHERE since_ms < ?"));
  query.Bind(since_ms);
  std::vector<Upload> uploads;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return uploads;
    uploads.push_back({query.Bytes(0), query.Integer(1)});
  }
}

absl::StatusOr<int64_t> JobTables::TotalBytes() {
  return database_.Number(absl::StrCat(
      "SELECT (SELECT COALESCE(SUM(bytes), 0) FROM blobs) +"
      " (SELECT COALESCE(SUM(bytes), 0) FROM uploads) + (SELECT COUNT(*) FROM jobs) * ",
      kJobRecordBytes));
}

absl::StatusOr<int64_t> JobTables::BytesOf(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT bytes FROM owners WHERE owner = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(owner).Step());
  return found ? query.Integer(0) : 0;
}

absl::StatusOr<std::vector<std::pair<std::string, int64_t>>> JobTables::Owners() {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("SELECT owner, bytes FROM owners ORDER BY bytes DESC"));
  std::vector<std::pair<std::string, int64_t>> owners;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return owners;
    owners.emplace_back(query.Bytes(0), query.Integer(1));
  }
}

absl::StatusOr<std::vector<std::string>> JobTables::Names(const std::string& sql,
                                                          const std::function<void(Query*)>& bind) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare(sql));
  bind(&query);
  std::vector<std::string> names;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return names;
    names.push_back(query.Bytes(0));
  }
}

absl::StatusOr<std::optional<std::string>> JobTables::OldestIdleScan(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(
      const auto names,
      Names("SELECT scan FROM scans JOIN uses ON blob = scan AND uses.owner = scans.owner"
            " WHERE scans.owner = ? AND count = 1 ORDER BY since_ms LIMIT 1",
            [&](Query* query) { query->Bind(owner); }));
  if (names.empty()) return std::nullopt;
  return names[0];
}

absl::StatusOr<std::optional<std::string>> JobTables::OldestFinished(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(const auto names,
                           Names("SELECT job_id FROM jobs WHERE owner = ? AND end_ms > 0"
                                 " ORDER BY end_ms, number LIMIT 1",
                                 [&](Query* query) { query->Bind(owner); }));
  if (names.empty()) return std::nullopt;
  return names[0];
}

absl::StatusOr<bool> JobTables::RemoveBefore(int64_t time_ms, int limit) {
  const auto bind = [&](Query* query) { query->Bind(time_ms).Bind(limit); };
  RILIEVO_ASSIGN_OR_RETURN(
      const auto jobs,
      Names("SELECT job_id FROM jobs WHERE end_ms > 0 AND end_ms < ? LIMIT ?", bind));
  for (const std::string& id : jobs) {
    RILIEVO_RETURN_IF_ERROR(Remove(id, /*its_scan=*/false).status());
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const auto scans, Names("SELECT DISTINCT scan FROM scans WHERE since_ms < ? LIMIT ?", bind));
  for (const std::string& scan : scans) {
    RILIEVO_ASSIGN_OR_RETURN(const auto owners,
                             Names("SELECT owner FROM scans WHERE scan = ? AND since_ms < ?",
                                   [&](Query* query) { query->Bind(scan).Bind(time_ms); }));
    for (const std::string& owner : owners) {
      RILIEVO_RETURN_IF_ERROR(DropScan(owner, scan).status());
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(const bool more_blobs, RemoveUnusedBlobs(time_ms, limit));
  RILIEVO_ASSIGN_OR_RETURN(Query damaged,
                           database_.Prepare("DELETE FROM damaged WHERE since_ms < ?"));
  RILIEVO_RETURN_IF_ERROR(damaged.Bind(time_ms).Run());
  if (database_.Changes() > 0) RILIEVO_RETURN_IF_ERROR(Recount());
  const auto full = static_cast<size_t>(limit);
  return jobs.size() == full || scans.size() == full || more_blobs;
}

absl::StatusOr<bool> JobTables::RemoveUnusedBlobs(int64_t time_ms, int limit) {
  RILIEVO_ASSIGN_OR_RETURN(const auto blobs,
                           Names("SELECT name FROM blobs WHERE since_ms < ? AND NOT EXISTS(SELECT 1"
                                 " FROM uses WHERE blob = name) LIMIT ?",
                                 [&](Query* query) { query->Bind(time_ms).Bind(limit); }));
  for (const std::string& blob : blobs) {
    RILIEVO_ASSIGN_OR_RETURN(Query drop, database_.Prepare("DELETE FROM blobs WHERE name = ?"));
    RILIEVO_RETURN_IF_ERROR(drop.Bind(blob).Run());
    gone_.push_back(blob);
  }
  return blobs.size() == static_cast<size_t>(limit);
}

absl::Status JobTables::Recount() {
  return database_.Execute(absl::StrCat(R"(
    DELETE FROM uses; DELETE FROM owners;
    INSERT INTO uses SELECT blob, owner, COUNT(*) FROM (
      SELECT scan AS blob, owner FROM scans
      UNION ALL SELECT scan, owner FROM jobs WHERE end_ms = 0
      UNION ALL SELECT mesh, owner FROM jobs WHERE end_ms = 0
      UNION ALL SELECT surface, owner FROM jobs
      UNION ALL SELECT scan, owner FROM damaged
      UNION ALL SELECT mesh, owner FROM damaged
      UNION ALL SELECT surface, owner FROM damaged)
    WHERE length(blob) > 0 GROUP BY blob, owner;
    INSERT INTO owners SELECT owner, SUM(bytes) FROM (
      SELECT uses.owner AS owner, bytes FROM uses JOIN blobs ON name = blob
      UNION ALL SELECT owner, )",
                                        kJobRecordBytes, R"( * COUNT(*) FROM jobs GROUP BY owner
      UNION ALL SELECT owner, bytes FROM uploads) GROUP BY owner;)"));
}

absl::StatusOr<int64_t> JobTables::State(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT value FROM state WHERE name = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  return found ? query.Integer(0) : 0;
}

absl::Status JobTables::SetState(const std::string& name, int64_t value) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("INSERT OR REPLACE INTO state VALUES(?, ?)"));
  return query.Bind(name).Bind(value).Run();
}

}  // namespace rilievo
