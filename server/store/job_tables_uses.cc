// Blobs, scans and uploads: who needs them, and what each owner's take.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/job_tables.h"

namespace rilievo {

absl::Status JobTables::AddBytes(const std::string& owner, int64_t bytes) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("INSERT INTO owners VALUES($1, $2) ON CONFLICT(owner) DO"
                                      " UPDATE SET bytes = owners.bytes + $2"));
  return query.Bind(owner).Bind(bytes).Post();
}

absl::Status JobTables::UseInputs(const StoredJob& stored) {
  RILIEVO_RETURN_IF_ERROR(UseAgain(stored.owner, stored.job.scan_id()));
  return stored.mesh.empty() ? absl::OkStatus() : Use(stored.owner, stored.mesh);
}

absl::Status JobTables::DropInputs(const StoredJob& stored) {
  RILIEVO_RETURN_IF_ERROR(Drop(stored.owner, stored.job.scan_id()));
  if (!stored.mesh.empty()) RILIEVO_RETURN_IF_ERROR(Drop(stored.owner, stored.mesh));
  if (!database_->shared()) return absl::OkStatus();
  return DropParts("job_id = $1", [&](Query* query) { query->Bind(stored.job.job_id()); });
}

absl::Status JobTables::DropPartsOfOthers(const PartWorker& leader) {
  return DropParts(
      "job_id = $1 AND recipe <> $2 AND EXISTS(SELECT 1 FROM queue WHERE queue.job_id = $1 AND"
      " queue.claim = $3 AND queue.worker = $4)",
      [&](Query* query) {
        query->Bind(leader.job_id).Bind(leader.recipe).Bind(leader.claim).Bind(leader.worker);
      });
}

absl::Status JobTables::DropLostParts() {
  return DropParts("NOT EXISTS(SELECT 1 FROM queue WHERE queue.job_id = job_parts.job_id)",
                   [](Query*) {});
}

// In one statement, which sees the tables as they were before it: there are thousands of parts.
absl::Status JobTables::DropParts(const std::string& where,
                                  const std::function<void(Query*)>& bind) {
  const std::string sql = absl::StrCat("WITH gone AS (DELETE FROM job_parts WHERE ", where, R"(
        RETURNING owner, result),
      needs AS (SELECT result AS blob, owner, COUNT(*) AS count FROM gone WHERE result <> ''
        GROUP BY result, owner),
      fewer AS (UPDATE uses SET count = uses.count - needs.count FROM needs
        WHERE uses.blob = needs.blob AND uses.owner = needs.owner AND uses.count > needs.count),
      last AS (DELETE FROM uses USING needs
        WHERE uses.blob = needs.blob AND uses.owner = needs.owner AND uses.count <= needs.count
        RETURNING uses.blob, uses.owner),
      less AS (UPDATE owners SET bytes = owners.bytes - takes.bytes FROM (
          SELECT last.owner, CAST(SUM(blobs.bytes) AS BIGINT) AS bytes
          FROM last JOIN blobs ON name = blob GROUP BY last.owner) AS takes
        WHERE owners.owner = takes.owner)
      DELETE FROM blobs WHERE name IN (SELECT blob FROM last) AND NOT EXISTS(SELECT 1 FROM uses
        WHERE uses.blob = name AND NOT EXISTS(SELECT 1 FROM last
          WHERE last.blob = uses.blob AND last.owner = uses.owner)) RETURNING name)");
  RILIEVO_ASSIGN_OR_RETURN(std::vector<std::string> gone, Names(sql, bind));
  gone_.insert(gone_.end(), gone.begin(), gone.end());
  return absl::OkStatus();
}

absl::Status JobTables::Use(const std::string& owner, const std::string& blob) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("INSERT INTO uses VALUES($1, $2, 1) ON CONFLICT(blob, owner) DO"
                         " UPDATE SET count = uses.count + 1 RETURNING count,"
                         " (SELECT bytes FROM blobs WHERE name = $1)"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(blob).Bind(owner).Step().status());
  const bool first = query.Integer(0) == 1;
  const int64_t bytes = query.Integer(1);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return first ? AddBytes(owner, bytes) : absl::OkStatus();
}

absl::Status JobTables::UseAgain(const std::string& owner, const std::string& blob) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("UPDATE uses SET count = count + 1 WHERE blob = $1 AND owner = $2"));
  return query.Bind(blob).Bind(owner).Post();
}

absl::StatusOr<bool> JobTables::Uses(const std::string& owner, const std::string& blob) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT 1 FROM uses WHERE blob = $1 AND owner = $2"));
  return query.Bind(blob).Bind(owner).Step();
}

absl::Status JobTables::Drop(const std::string& owner, const std::string& blob) {
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query,
        database_->Prepare("UPDATE uses SET count = count - 1 WHERE blob = $1 AND owner"
                           " = $2 RETURNING count"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(blob).Bind(owner).Step());
    if (!found || query.Integer(0) > 0) return found ? query.Run() : absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(query.Run());
  }
  RILIEVO_ASSIGN_OR_RETURN(Query drop,
                           database_->Prepare("DELETE FROM uses WHERE blob = $1 AND owner = $2"));
  RILIEVO_RETURN_IF_ERROR(drop.Bind(blob).Bind(owner).Post());
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, BytesOfBlob(blob));
  RILIEVO_RETURN_IF_ERROR(AddBytes(owner, -std::max<int64_t>(0, bytes)));
  RILIEVO_ASSIGN_OR_RETURN(
      Query forget, database_->Prepare("DELETE FROM blobs WHERE name = $1 AND NOT EXISTS(SELECT 1"
                                       " FROM uses WHERE blob = $1)"));
  RILIEVO_RETURN_IF_ERROR(forget.Bind(blob).Run());
  if (database_->Changes() == 1) gone_.push_back(blob);
  return absl::OkStatus();
}

absl::Status JobTables::AddBlob(const std::string& name, int64_t bytes, int64_t now_ms) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("INSERT INTO blobs VALUES($1, $2, $3) ON CONFLICT(name) DO"
                                      " UPDATE SET since_ms = $3"));
  return query.Bind(name).Bind(bytes).Bind(now_ms).Post();
}

absl::Status JobTables::ForgetBlob(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare("DELETE FROM blobs WHERE name = $1"));
  return query.Bind(name).Run();
}

absl::StatusOr<std::vector<std::string>> JobTables::BlobNames() {
  return Names("SELECT name FROM blobs", [](Query*) {});
}

absl::StatusOr<int64_t> JobTables::BytesOfBlob(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT bytes FROM blobs WHERE name = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  return found ? query.Integer(0) : -1;
}

absl::Status JobTables::AddScan(const std::string& owner, const std::string& scan, int64_t now_ms) {
  RILIEVO_ASSIGN_OR_RETURN(const bool had, HasScan(owner, scan));
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("INSERT INTO scans VALUES($1, $2, $3) ON CONFLICT"
                                              "(owner, scan) DO UPDATE SET since_ms = $3"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(owner).Bind(scan).Bind(now_ms).Post());
  return had ? absl::OkStatus() : Use(owner, scan);
}

absl::StatusOr<bool> JobTables::HasScan(const std::string& owner, const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT 1 FROM scans WHERE owner = $1 AND scan = $2"));
  return query.Bind(owner).Bind(scan).Step();
}

absl::StatusOr<bool> JobTables::DropScan(const std::string& owner, const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("DELETE FROM scans WHERE owner = $1 AND scan = $2"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(owner).Bind(scan).Run());
  if (database_->Changes() == 0) return false;
  RILIEVO_RETURN_IF_ERROR(Drop(owner, scan));
  return true;
}

absl::Status JobTables::ForgetScan(const std::string& scan) {
  RILIEVO_ASSIGN_OR_RETURN(const auto owners, Names("SELECT owner FROM scans WHERE scan = $1",
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
                           database_->Prepare("INSERT INTO uploads VALUES($1, $2, $3, $4)"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(name).Bind(owner).Bind(bytes).Bind(now_ms).Post());
  return AddBytes(owner, bytes);
}

absl::Status JobTables::DropUpload(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("DELETE FROM uploads WHERE name = $1 RETURNING owner, bytes"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  if (!found) return absl::OkStatus();
  const std::string owner = query.Bytes(0);
  const int64_t bytes = query.Integer(1);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return AddBytes(owner, -bytes);
}

absl::StatusOr<std::optional<JobTables::Upload>> JobTables::FindUpload(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT bytes FROM uploads WHERE name = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  if (!found) return std::nullopt;
  return Upload{name, query.Integer(0)};
}

absl::StatusOr<std::vector<JobTables::Upload>> JobTables::UploadsOf(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT name, bytes FROM uploads WHERE owner = $1"
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
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT name, bytes FROM uploads WHERE since_ms < $1"));
  query.Bind(since_ms);
  std::vector<Upload> uploads;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return uploads;
    uploads.push_back({query.Bytes(0), query.Integer(1)});
  }
}

// What is kept free for parts, as a term of SQL; `where`: of the jobs of which that holds.
std::string JobTables::Reserved(const std::string& where) const {
  if (!database_->shared()) return "0";
  return absl::StrCat("(SELECT COALESCE(SUM(reserved.bytes), 0) FROM reserved",
                      where.empty() ? "" : " WHERE reserved.", where, ")");
}

absl::StatusOr<int64_t> JobTables::BytesReserved(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT bytes FROM reserved WHERE job_id = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  return found ? query.Integer(0) : 0;
}

absl::StatusOr<int64_t> JobTables::TotalBytes() {
  return database_->Number(absl::StrCat(
      "SELECT CAST((SELECT COALESCE(SUM(bytes), 0) FROM blobs) +"
      " (SELECT COALESCE(SUM(bytes), 0) FROM uploads) + ",
      Reserved(""), " + (SELECT COUNT(*) FROM jobs) * ", kJobRecordBytes, " AS BIGINT)"));
}

absl::StatusOr<int64_t> JobTables::BytesOfAll() {
  return database_->Number(absl::StrCat(
      "SELECT CAST((SELECT COALESCE(SUM(bytes), 0) FROM owners) + ", Reserved(""), " AS BIGINT)"));
}

absl::StatusOr<int64_t> JobTables::BytesOf(const std::string& owner) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(absl::StrCat("SELECT CAST(bytes + ", Reserved("owner = owners.owner"),
                                      " AS BIGINT) FROM owners WHERE owner = $1")));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(owner).Step());
  return found ? query.Integer(0) : 0;
}

absl::StatusOr<int64_t> JobTables::BytesInUse(const std::optional<std::string>& owner,
                                              const std::string& scan) {
  const std::string of_owner = owner ? "owner = $2" : "";
  const std::string jobs =
      absl::StrCat(" FROM jobs WHERE end_ms = 0", owner ? " AND " : "", of_owner);
  const std::string parts = database_->shared()
                                ? absl::StrCat(" UNION ALL SELECT result FROM job_parts",
                                               owner ? " WHERE " : "", of_owner)
                                : "";
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(absl::StrCat(
          "SELECT CAST((SELECT COALESCE(SUM(bytes), 0) FROM blobs WHERE name IN (SELECT name FROM"
          " blobs WHERE name = $1 UNION ALL SELECT scan",
          jobs, " UNION ALL SELECT mesh", jobs, parts, ")) + ", Reserved(of_owner),
          " + (SELECT COUNT(*)", jobs, ") * ", kJobRecordBytes, " AS BIGINT)")));
  query.Bind(scan);
  if (owner) query.Bind(*owner);
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Step());
  return found ? query.Integer(0) : 0;
}

absl::StatusOr<std::vector<std::pair<std::string, int64_t>>> JobTables::Owners() {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare(
                       absl::StrCat("SELECT owner, CAST(bytes + ", Reserved("owner = owners.owner"),
                                    " AS BIGINT) AS takes FROM owners ORDER BY takes DESC")));
  std::vector<std::pair<std::string, int64_t>> owners;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return owners;
    owners.emplace_back(query.Bytes(0), query.Integer(1));
  }
}

absl::StatusOr<std::vector<std::string>> JobTables::Names(const std::string& sql,
                                                          const std::function<void(Query*)>& bind) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(sql));
  bind(&query);
  std::vector<std::string> names;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return names;
    names.push_back(query.Bytes(0));
  }
}

absl::StatusOr<std::optional<std::string>> JobTables::OldestIdleScan(const std::string& owner,
                                                                     const std::string& except) {
  RILIEVO_ASSIGN_OR_RETURN(
      const auto names,
      Names("SELECT scan FROM scans JOIN uses ON blob = scan AND uses.owner = scans.owner"
            " WHERE scans.owner = $1 AND scan <> $2 AND count = 1 ORDER BY since_ms LIMIT 1",
            [&](Query* query) { query->Bind(owner).Bind(except); }));
  if (names.empty()) return std::nullopt;
  return names[0];
}

absl::StatusOr<bool> JobTables::RemoveUnusedBlobs(int64_t time_ms, int limit) {
  RILIEVO_ASSIGN_OR_RETURN(
      const auto blobs, Names("SELECT name FROM blobs WHERE since_ms < $1 AND NOT EXISTS(SELECT 1"
                              " FROM uses WHERE blob = name) LIMIT $2",
                              [&](Query* query) { query->Bind(time_ms).Bind(limit); }));
  for (const std::string& blob : blobs) {
    RILIEVO_ASSIGN_OR_RETURN(Query drop, database_->Prepare("DELETE FROM blobs WHERE name = $1"));
    RILIEVO_RETURN_IF_ERROR(drop.Bind(blob).Run());
    gone_.push_back(blob);
  }
  return blobs.size() == static_cast<size_t>(limit);
}

absl::Status JobTables::Recount() {
  const char* const parts =
      database_->shared() ? " UNION ALL SELECT result, owner FROM job_parts" : "";
  return database_->Execute(absl::StrCat(R"(
    DELETE FROM uses; DELETE FROM owners;
    INSERT INTO uses SELECT blob, owner, COUNT(*) FROM (
      SELECT scan AS blob, owner FROM scans
      UNION ALL SELECT scan, owner FROM jobs WHERE end_ms = 0
      UNION ALL SELECT mesh, owner FROM jobs WHERE end_ms = 0
      UNION ALL SELECT surface, owner FROM jobs
      UNION ALL SELECT scan, owner FROM damaged
      UNION ALL SELECT mesh, owner FROM damaged
      UNION ALL SELECT surface, owner FROM damaged)",
                                         parts, R"() AS needs
    WHERE length(blob) > 0 GROUP BY blob, owner;
    INSERT INTO owners SELECT owner, SUM(bytes) FROM (
      SELECT uses.owner AS owner, bytes FROM uses JOIN blobs ON name = blob
      UNION ALL SELECT owner, )",
                                         kJobRecordBytes, R"( * COUNT(*) FROM jobs GROUP BY owner
      UNION ALL SELECT owner, bytes FROM uploads) AS takes GROUP BY owner;)"));
}

}  // namespace rilievo
