#include "server/store/database.h"

#include <sqlite3.h>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

absl::Status StatusOf(sqlite3* database) {
  const int code = sqlite3_extended_errcode(database);
  const std::string message = absl::StrCat("database: ", sqlite3_errmsg(database));
  switch (code & 0xff) {
    case SQLITE_OK:
    case SQLITE_ROW:
    case SQLITE_DONE:
      return absl::OkStatus();
    case SQLITE_FULL:
    case SQLITE_NOMEM:
    case SQLITE_CANTOPEN:
      return absl::ResourceExhaustedError(message);
    case SQLITE_IOERR:
      // A write that is refused for want of room may be told as an error of the device.
      return code == SQLITE_IOERR_WRITE || code == SQLITE_IOERR_SHMSIZE ||
                     code == SQLITE_IOERR_FSYNC || code == SQLITE_IOERR_TRUNCATE
                 ? absl::ResourceExhaustedError(message)
                 : absl::InternalError(message);
    case SQLITE_CONSTRAINT:
      return absl::AlreadyExistsError(message);
    default:
      return absl::InternalError(message);
  }
}

}  // namespace

void Query::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Query& Query::Bind(int64_t value) {
  sqlite3_bind_int64(statement_.get(), ++bound_, value);
  return *this;
}

Query& Query::Bind(const std::string& value) {
  sqlite3_bind_blob64(statement_.get(), ++bound_, value.data(), value.size(), SQLITE_TRANSIENT);
  return *this;
}

absl::StatusOr<bool> Query::Step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return StatusOf(sqlite3_db_handle(statement_.get()));
}

absl::Status Query::Run() {
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, Step());
    if (!row) return absl::OkStatus();
  }
}

int64_t Query::Integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

std::string Query::Bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return data == nullptr ? std::string() : std::string(data, static_cast<size_t>(size));
}

void Database::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

absl::StatusOr<Database> Database::Open(const std::string& path, int version, const char* schema,
                                        const char* from_previous) {
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(path.c_str(), &handle,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  Database database(handle);
  if (code != SQLITE_OK) return StatusOf(handle);
  sqlite3_extended_result_codes(handle, 1);
  RILIEVO_RETURN_IF_ERROR(database.Execute(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON;"));
  int64_t found = 0;
  {
    RILIEVO_ASSIGN_OR_RETURN(Query query, database.Prepare("PRAGMA user_version"));
    RILIEVO_RETURN_IF_ERROR(query.Step().status());
    found = query.Integer(0);
  }
  const bool of_previous = from_previous != nullptr && found == version - 1;
  if (found == 0 || of_previous) {
    const std::string all = absl::StrCat("BEGIN; ", of_previous ? from_previous : schema,
                                         "; PRAGMA user_version = ", version, "; COMMIT;");
    RILIEVO_RETURN_IF_ERROR(database.Execute(all.c_str()));
  } else if (found != version) {
    return absl::UnavailableError(absl::StrCat("the store is of version ", found,
                                               ", this server reads version ", version,
                                               "; give it another folder"));
  }
  return database;
}

absl::StatusOr<Query> Database::Prepare(const char* sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr) != SQLITE_OK) {
    return StatusOf(database_.get());
  }
  return Query(statement);
}

absl::Status Database::Execute(const char* sql) {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK) {
    return absl::OkStatus();
  }
  const absl::Status status = StatusOf(database_.get());
  // A transaction that failed half-way must not stay open.
  if (sqlite3_get_autocommit(database_.get()) == 0) {
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
  return status;
}

int Database::Changes() const { return sqlite3_changes(database_.get()); }

}  // namespace rilievo
