#include "server/store/job_tables.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/job_queue.h"

namespace rilievo {
namespace {

// `number` grows over all owners, `turn` over the jobs of one. `end_ms` is 0 while a job is not
// finished. Times are of the store's clock.
// Of SQLite; PostgreSQL's is in server/postgres.
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

absl::Status JobTables::Make(SqliteDatabase* database) {
  return database->Make(kSchemaVersion, kSchema);
}

absl::Status JobTables::Transact(const std::function<absl::Status()>& body) {
  gone_.clear();
  const absl::Status done = database_->Transact(body);
  if (!done.ok()) gone_.clear();
  return done;
}

// Where there is one process, whoever has the tables is alone.
absl::Status JobTables::Alone(const std::function<absl::Status()>& body) {
  return database_->shared() ? database_->Transact(body) : body();
}

absl::StatusOr<std::vector<std::pair<int64_t, StoredJob>>> JobTables::Read(
    const std::string& where, const std::function<void(Query*)>& bind) {
  std::vector<std::pair<int64_t, StoredJob>> jobs;
  std::vector<std::pair<int64_t, std::string>> damaged;
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database_->Prepare(absl::StrCat("SELECT ", kColumns, " FROM jobs ", where)));
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

absl::StatusOr<std::optional<StoredJob>> JobTables::Find(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(auto rows,
                           Read("WHERE job_id = $1", [&](Query* query) { query->Bind(job_id); }));
  if (rows.empty()) return std::nullopt;
  return std::move(rows[0].second);
}

absl::StatusOr<std::optional<StoredJob>> JobTables::Find(const std::string& owner,
                                                         const std::string& request_id) {
  RILIEVO_ASSIGN_OR_RETURN(auto rows,
                           Read("WHERE owner = $1 AND request_id = $2",
                                [&](Query* query) { query->Bind(owner).Bind(request_id); }));
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
        rows, Read("WHERE owner = $1 AND ($2 = 0 OR turn < $2) ORDER BY turn DESC LIMIT $3",
                   [&](Query* query) { query->Bind(owner).Bind(*before).Bind(limit + 1); }));
  } while (damaged != damaged_.size());
  *before = 0;
  if (rows.size() > static_cast<size_t>(limit)) {
    rows.pop_back();
    RILIEVO_ASSIGN_OR_RETURN(Query turn,
                             database_->Prepare("SELECT turn FROM jobs WHERE number = $1"));
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
  RILIEVO_ASSIGN_OR_RETURN(
      Query last, database_->Prepare("SELECT MAX(number) FROM (SELECT number FROM jobs"
                                     " WHERE number > $1 ORDER BY number LIMIT $2) AS page"));
  RILIEVO_RETURN_IF_ERROR(last.Bind(*number).Bind(limit).Step().status());
  const int64_t to = last.Integer(0);
  RILIEVO_RETURN_IF_ERROR(last.Run());
  RILIEVO_ASSIGN_OR_RETURN(auto rows, Read("WHERE number > $1 AND number <= $2 ORDER BY number",
                                           [&](Query* query) { query->Bind(*number).Bind(to); }));
  *number = to;
  std::vector<StoredJob> jobs;
  jobs.reserve(rows.size());
  for (auto& [row, stored] : rows) jobs.push_back(std::move(stored));
  return jobs;
}

absl::Status JobTables::Insert(const StoredJob& stored, int64_t end_ms, int64_t now_ms) {
  const JobRow row = EncodeJob(stored, end_ms);
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare(
                       "INSERT INTO jobs(job_id, owner, turn, request_id, client, scan, mesh,"
                       " surface, end_ms, unclean_ends, header, job, checksum)"
                       " VALUES($1, $2, (SELECT COALESCE(MAX(turn), 0) + 1 FROM jobs WHERE owner ="
                       " $2), $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)"));
  query.Bind(stored.job.job_id()).Bind(stored.owner).Bind(stored.job.request_id());
  query.Bind(stored.client).Bind(stored.job.scan_id()).Bind(stored.mesh).Bind(stored.surface);
  query.Bind(end_ms).Bind(stored.unclean_ends).Bind(row.header).Bind(row.job).Bind(row.checksum);
  RILIEVO_RETURN_IF_ERROR(query.Post());
  RILIEVO_RETURN_IF_ERROR(AddBytes(stored.owner, kJobRecordBytes));
  if (end_ms != 0) {
    return stored.surface.empty() ? absl::OkStatus() : Use(stored.owner, stored.surface);
  }
  RILIEVO_RETURN_IF_ERROR(UseInputs(stored));
  RILIEVO_ASSIGN_OR_RETURN(
      Query touch,
      database_->Prepare("UPDATE scans SET since_ms = $1 WHERE owner = $2 AND scan = $3"));
  return touch.Bind(now_ms).Bind(stored.owner).Bind(stored.job.scan_id()).Post();
}

absl::StatusOr<bool> JobTables::Update(const StoredJob& stored, int64_t now_ms) {
  const bool ends = IsFinished(stored.job.state());
  const int64_t end_ms = ends ? now_ms : 0;
  const JobRow row = EncodeJob(stored, end_ms);
  {
    const char* const held = stored.claim == 0
                                 ? ""
                                 : " AND EXISTS(SELECT 1 FROM queue WHERE job_id = $6 AND claim ="
                                   " $7 AND worker = $8)";
    RILIEVO_ASSIGN_OR_RETURN(
        Query query,
        database_->Prepare(absl::StrCat("UPDATE jobs SET surface = $1, end_ms = $2, unclean_ends ="
                                        " $3, job = $4, checksum = $5 WHERE job_id = $6 AND end_ms"
                                        " = 0",
                                        held)));
    query.Bind(stored.surface).Bind(end_ms).Bind(stored.unclean_ends).Bind(row.job);
    query.Bind(row.checksum).Bind(stored.job.job_id());
    if (stored.claim != 0) query.Bind(stored.claim).Bind(stored.worker);
    RILIEVO_RETURN_IF_ERROR(query.Run());
    if (database_->Changes() != 1) return false;
  }
  if (!ends) return true;
  if (!stored.surface.empty()) RILIEVO_RETURN_IF_ERROR(Use(stored.owner, stored.surface));
  RILIEVO_ASSIGN_OR_RETURN(
      Query touch,
      database_->Prepare("UPDATE scans SET since_ms = $1 WHERE owner = $2 AND scan = $3"));
  RILIEVO_RETURN_IF_ERROR(touch.Bind(now_ms).Bind(stored.owner).Bind(stored.job.scan_id()).Post());
  RILIEVO_RETURN_IF_ERROR(DropInputs(stored));
  return true;
}

absl::StatusOr<bool> JobTables::Remove(const std::string& job_id, bool its_scan) {
  StoredJob stored;
  bool finished;
  std::string scan;
  {
    RILIEVO_ASSIGN_OR_RETURN(Query query,
                             database_->Prepare("DELETE FROM jobs WHERE job_id = $1"
                                                " RETURNING owner, scan, mesh, surface, end_ms"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
    if (!found) return false;
    stored.owner = query.Bytes(0);
    scan = query.Bytes(1);
    stored.job.set_job_id(job_id);
    stored.job.set_scan_id(scan);
    stored.mesh = query.Bytes(2);
    stored.surface = query.Bytes(3);
    finished = query.Integer(4) != 0;
    RILIEVO_RETURN_IF_ERROR(query.Run());
  }
  RILIEVO_RETURN_IF_ERROR(AddBytes(stored.owner, -kJobRecordBytes));
  if (!finished) {
    RILIEVO_RETURN_IF_ERROR(DropInputs(stored));
    if (database_->shared()) RILIEVO_RETURN_IF_ERROR(JobQueue(database_.get()).Remove(job_id));
  }
  if (!stored.surface.empty()) RILIEVO_RETURN_IF_ERROR(Drop(stored.owner, stored.surface));
  if (!its_scan) return true;
  RILIEVO_ASSIGN_OR_RETURN(
      Query others,
      database_->Prepare("SELECT 1 FROM jobs WHERE scan = $1 AND owner = $2 LIMIT 1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool needed, others.Bind(scan).Bind(stored.owner).Step());
  if (!needed) RILIEVO_RETURN_IF_ERROR(DropScan(stored.owner, scan).status());
  return true;
}

absl::StatusOr<std::optional<std::string>> JobTables::OldestFinished(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(const auto names,
                           Names("SELECT job_id FROM jobs WHERE owner = $1 AND end_ms > 0"
                                 " ORDER BY end_ms, number LIMIT 1",
                                 [&](Query* query) { query->Bind(owner); }));
  if (names.empty()) return std::nullopt;
  return names[0];
}

absl::StatusOr<bool> JobTables::RemoveBefore(int64_t time_ms, int limit) {
  const auto bind = [&](Query* query) { query->Bind(time_ms).Bind(limit); };
  RILIEVO_ASSIGN_OR_RETURN(
      const auto jobs,
      Names("SELECT job_id FROM jobs WHERE end_ms > 0 AND end_ms < $1 LIMIT $2", bind));
  for (const std::string& id : jobs) {
    RILIEVO_RETURN_IF_ERROR(Remove(id, /*its_scan=*/false).status());
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const auto scans,
      Names("SELECT DISTINCT scan FROM scans WHERE since_ms < $1 LIMIT $2", bind));
  for (const std::string& scan : scans) {
    RILIEVO_ASSIGN_OR_RETURN(const auto owners,
                             Names("SELECT owner FROM scans WHERE scan = $1 AND since_ms < $2",
                                   [&](Query* query) { query->Bind(scan).Bind(time_ms); }));
    for (const std::string& owner : owners) {
      RILIEVO_RETURN_IF_ERROR(DropScan(owner, scan).status());
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(const bool more_blobs, RemoveUnusedBlobs(time_ms, limit));
  RILIEVO_ASSIGN_OR_RETURN(Query damaged,
                           database_->Prepare("DELETE FROM damaged WHERE since_ms < $1"));
  RILIEVO_RETURN_IF_ERROR(damaged.Bind(time_ms).Run());
  if (database_->Changes() > 0) RILIEVO_RETURN_IF_ERROR(Recount());
  const auto full = static_cast<size_t>(limit);
  return jobs.size() == full || scans.size() == full || more_blobs;
}

absl::StatusOr<int64_t> JobTables::State(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT value FROM state WHERE name = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  return found ? query.Integer(0) : 0;
}

absl::Status JobTables::SetState(const std::string& name, int64_t value) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("INSERT INTO state VALUES($1, $2) ON CONFLICT(name)"
                                              " DO UPDATE SET value = $2"));
  return query.Bind(name).Bind(value).Post();
}

}  // namespace rilievo
