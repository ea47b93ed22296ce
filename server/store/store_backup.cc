#include "server/store/store_backup.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "core/base/status_macros.h"
#include "server/store/folder.h"
#include "server/store/job_tables.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

// A job that is removed while its blobs are linked leaves some missing; then the next copy is
// right.
constexpr int kRounds = 10;

// Whether it is there now.
absl::StatusOr<bool> LinkOrCopy(const std::string& from, const std::string& to) {
  if (link(from.c_str(), to.c_str()) == 0 || errno == EEXIST) return true;
  if (errno == ENOENT) return false;
  std::error_code error;
  fs::copy_file(from, to, error);
  if (error == std::errc::no_such_file_or_directory) return false;
  if (error) return StatusOfErrno(error.value(), "copying " + from);
  RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor file, OpenFile(to, O_RDONLY));
  RILIEVO_RETURN_IF_ERROR(SyncFile(file));
  return true;
}

absl::StatusOr<std::vector<std::string>> NamesIn(const std::string& database) {
  RILIEVO_ASSIGN_OR_RETURN(SqliteDatabase copy, SqliteDatabase::Open(database));
  // Cut uploads stay behind.
  RILIEVO_RETURN_IF_ERROR(copy.Execute("DELETE FROM uploads"));
  JobTables tables(std::move(copy));
  RILIEVO_RETURN_IF_ERROR(tables.Recount());
  RILIEVO_RETURN_IF_ERROR(tables.database().Shrink());
  return tables.BlobNames();
}

}  // namespace

absl::Status BackUpStore(const std::string& folder, const std::string& target) {
  if (!fs::exists(folder + "/jobs.db")) {
    return absl::NotFoundError(absl::StrCat(folder, " holds no store; give --store"));
  }
  RILIEVO_RETURN_IF_ERROR(MakeFolder(target));
  if (fs::exists(target + "/jobs.db")) {
    return absl::AlreadyExistsError(
        absl::StrCat(target, " holds a store already; give an empty folder"));
  }
  RILIEVO_RETURN_IF_ERROR(MakeFolder(target + "/blobs"));
  const std::string fresh = target + "/jobs.db.new";
  RILIEVO_ASSIGN_OR_RETURN(SqliteDatabase database, SqliteDatabase::Open(folder + "/jobs.db"));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t version, database.Version());
  if (version != kSchemaVersion) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the store is of version ", version, "; start rilievod of this version on it first"));
  }
  size_t missing = 0;
  for (int round = 0; round < kRounds; ++round) {
    for (const char* end : {"", "-wal", "-shm"}) RILIEVO_RETURN_IF_ERROR(RemoveFile(fresh + end));
    RILIEVO_RETURN_IF_ERROR(database.Execute(
        absl::StrCat("VACUUM INTO '", absl::StrReplaceAll(fresh, {{"'", "''"}}), "'")));
    RILIEVO_ASSIGN_OR_RETURN(const auto names, NamesIn(fresh));
    missing = 0;
    for (const std::string& name : names) {
      RILIEVO_ASSIGN_OR_RETURN(const bool there,
                               LinkOrCopy(folder + "/blobs/" + name, target + "/blobs/" + name));
      missing += !there;
    }
    if (missing > 0) continue;
    for (const char* end : {"-wal", "-shm"}) RILIEVO_RETURN_IF_ERROR(RemoveFile(fresh + end));
    RILIEVO_RETURN_IF_ERROR(SyncFolder(target + "/blobs"));
    if (std::rename(fresh.c_str(), (target + "/jobs.db").c_str()) != 0) {
      return StatusOfErrno(errno, "naming the copy");
    }
    return SyncFolder(target);
  }
  return absl::DataLossError(
      absl::StrCat(missing, " scans or surfaces of the store are not there; see --check-store"));
}

}  // namespace rilievo
