#include "server/store/store_tables.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/control_mesh_blob.h"
#include "server/store/folder.h"
#include "server/store/store_clock.h"

namespace rilievo {
namespace {

// Of all versions.
constexpr char kOldColumns[] =
    "number, job_id, owner, request_id, client, scan, surface, end_ms, header, job";

absl::Status Remedy(const std::string& folder, const std::string& what) {
  return absl::DataLossError(absl::StrCat(
      what,
      "; put back a backup of it (rilievod --backup), or save what can be read of it: rilievod "
      "--store ",
      folder, " --check-store --repair"));
}

void RemoveDatabase(const std::string& path) {
  for (const char* end : {"", "-wal", "-shm"}) RemoveFile(path + end).IgnoreError();
}

// What of a row of another database goes into the new tables.
absl::Status CopyJob(const Query& row, int64_t version, const BlobFolder& blobs, int64_t now_ms,
                     JobTables* tables, RewriteResult* result) {
  StoredJob stored;
  stored.owner = row.Bytes(2);
  stored.client = row.Bytes(4);
  stored.surface = row.Bytes(6);
  const int64_t end_ms = std::min(row.Integer(7), now_ms);
  bool right = stored.header.ParseFromString(row.Bytes(8)) &&
               stored.job.ParseFromString(row.Bytes(9)) && stored.job.job_id() == row.Bytes(1);
  if (right && version >= 3) {
    stored.mesh = row.Bytes(10);
    stored.unclean_ends = static_cast<int>(row.Integer(11));
    right = DecodeJob({row.Bytes(8), row.Bytes(9), row.Integer(7), row.Integer(12)}, &stored).ok();
  }
  if (!right) {
    ++result->damaged;
    RILIEVO_ASSIGN_OR_RETURN(
        Query damaged, tables->database().Prepare("INSERT OR REPLACE INTO damaged VALUES(?, ?, ?,"
                                                  " x'', ?, ?, ?, ?)"));
    damaged.Bind(row.Bytes(1)).Bind(row.Bytes(2)).Bind(row.Bytes(5)).Bind(row.Bytes(6));
    return damaged.Bind(now_ms).Bind(row.Bytes(8)).Bind(row.Bytes(9)).Run();
  }
  RILIEVO_ASSIGN_OR_RETURN(const auto mesh, TakeControlMesh(blobs, &stored));
  if (mesh) RILIEVO_RETURN_IF_ERROR(mesh->Adopt(nullptr));
  const absl::Status inserted = tables->Insert(stored, end_ms, now_ms);
  // Damage may show a row twice.
  if (absl::IsAlreadyExists(inserted)) return absl::OkStatus();
  ++result->jobs;
  return inserted;
}

// Rows from both ends, so that a page which cannot be read in the middle costs no more than itself.
absl::Status CopyJobs(SqliteDatabase* old, int64_t version, const BlobFolder& blobs, int64_t now_ms,
                      JobTables* tables, RewriteResult* result) {
  const std::string columns =
      absl::StrCat(kOldColumns, version >= 3 ? ", mesh, unclean_ends, checksum" : "");
  for (const char* order : {"ASC", "DESC"}) {
    RILIEVO_ASSIGN_OR_RETURN(
        Query rows,
        old->Prepare(absl::StrCat("SELECT ", columns, " FROM jobs ORDER BY number ", order)));
    for (;;) {
      const absl::StatusOr<bool> row = rows.Step();
      if (row.ok() && !*row) return absl::OkStatus();
      if (!row.ok()) break;
      RILIEVO_RETURN_IF_ERROR(CopyJob(rows, version, blobs, now_ms, tables, result));
    }
    ++result->damaged;
  }
  return absl::OkStatus();
}

// Version 1 had no scans: whoever made a job of one goes on using it.
absl::Status CopyScans(SqliteDatabase* old, int64_t version, int64_t now_ms, JobTables* tables) {
  auto rows = old->Prepare(version == 1 ? "SELECT DISTINCT owner, scan FROM jobs"
                                        : "SELECT owner, scan FROM scans");
  for (bool more = rows.ok(); more;) {
    const absl::StatusOr<bool> row = rows->Step();
    more = row.ok() && *row;
    if (more) RILIEVO_RETURN_IF_ERROR(tables->AddScan(rows->Bytes(0), rows->Bytes(1), now_ms));
  }
  return absl::OkStatus();
}

// `old` may be none.
absl::Status CopyAll(SqliteDatabase* old, const BlobFolder& blobs, JobTables* tables,
                     RewriteResult* result) {
  const int64_t now_ms = StoreClock::System().wall_ms();
  if (old != nullptr) {
    RILIEVO_ASSIGN_OR_RETURN(const int64_t version, old->Version());
    RILIEVO_RETURN_IF_ERROR(CopyJobs(old, version, blobs, now_ms, tables, result));
    RILIEVO_RETURN_IF_ERROR(CopyScans(old, version, now_ms, tables));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, blobs.List());
  for (const FileEntry& file : files) {
    RILIEVO_RETURN_IF_ERROR(tables->AddBlob(file.name, file.bytes, now_ms));
  }
  return tables->Recount();
}

}  // namespace

absl::StatusOr<RewriteResult> RewriteTables(const std::string& folder, const BlobFolder& blobs) {
  const std::string path = folder + "/jobs.db", fresh = path + ".new", kept = path + ".old";
  RemoveDatabase(fresh);
  RewriteResult result;
  {
    RILIEVO_ASSIGN_OR_RETURN(SqliteDatabase old, SqliteDatabase::Open(path));
    const int64_t version = old.Version().value_or(0);
    RILIEVO_ASSIGN_OR_RETURN(SqliteDatabase database, SqliteDatabase::Open(fresh));
    RILIEVO_RETURN_IF_ERROR(JobTables::Make(&database));
    JobTables tables(std::move(database));
    RILIEVO_RETURN_IF_ERROR(tables.Transact(
        [&] { return CopyAll(version > 0 ? &old : nullptr, blobs, &tables, &result); }));
    RILIEVO_RETURN_IF_ERROR(tables.database().Shrink());
    old.Shrink().IgnoreError();
  }
  RemoveFile(kept).IgnoreError();
  if (link(path.c_str(), kept.c_str()) != 0 || std::rename(fresh.c_str(), path.c_str()) != 0) {
    return StatusOfErrno(errno, "replacing the database");
  }
  for (const char* end : {"-wal", "-shm"}) RILIEVO_RETURN_IF_ERROR(RemoveFile(path + end));
  RILIEVO_RETURN_IF_ERROR(SyncFolder(folder));
  return result;
}

absl::StatusOr<JobTables> OpenTables(const std::string& folder, const BlobFolder& blobs) {
  const std::string path = folder + "/jobs.db";
  bool is_new = true;
  if (const auto file = OpenFile(path, O_RDONLY); file.ok()) {
    RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, file->Size());
    is_new = bytes == 0;
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, blobs.List());
  if (is_new && !files.empty()) {
    return Remedy(folder, absl::StrCat(path, " is missing or empty, though ", files.size(),
                                       " files of scans and surfaces are stored"));
  }
  absl::StatusOr<SqliteDatabase> database = SqliteDatabase::Open(path);
  if (absl::IsDataLoss(database.status())) return Remedy(folder, path + " is damaged");
  RILIEVO_RETURN_IF_ERROR(database.status());
  RILIEVO_ASSIGN_OR_RETURN(int64_t version, database->Version());
  if (version > kSchemaVersion) {
    return absl::UnavailableError(absl::StrCat("the store is of version ", version,
                                               ", this server reads version ", kSchemaVersion,
                                               "; give it another folder"));
  }
  if (version == 0) {
    RILIEVO_RETURN_IF_ERROR(JobTables::Make(&*database));
    return JobTables(*std::move(database));
  }
  {
    // Not quick_check, which does not look into the indices.
    RILIEVO_ASSIGN_OR_RETURN(Query check, database->Prepare("PRAGMA integrity_check(1)"));
    const absl::StatusOr<bool> row = check.Step();
    if (!row.ok() || check.Bytes(0) != "ok") return Remedy(folder, path + " is damaged");
  }
  if (version == kSchemaVersion) return JobTables(*std::move(database));
  database = absl::UnknownError("closed");
  RILIEVO_RETURN_IF_ERROR(RewriteTables(folder, blobs).status());
  RILIEVO_ASSIGN_OR_RETURN(SqliteDatabase rewritten, SqliteDatabase::Open(path));
  RILIEVO_RETURN_IF_ERROR(RemoveFile(path + ".old"));
  return JobTables(std::move(rewritten));
}

}  // namespace rilievo
