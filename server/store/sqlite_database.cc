#include "server/store/sqlite_database.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <cerrno>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/os/file_descriptor.h"

namespace rilievo {
namespace {

constexpr int kBusyMilliseconds = 5000;

absl::Status StatusOfSqlite(sqlite3* database) {
  const int code = sqlite3_extended_errcode(database);
  const std::string message = absl::StrCat("database: ", sqlite3_errmsg(database));
  switch (code & 0xff) {
    case SQLITE_OK:
    case SQLITE_ROW:
    case SQLITE_DONE:
      return absl::OkStatus();
    case SQLITE_FULL:
    case SQLITE_NOMEM:
      return absl::ResourceExhaustedError(message);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_PROTOCOL:
    case SQLITE_CANTOPEN:  // its folder is gone, or no file handle is free
      return absl::UnavailableError(message);
    case SQLITE_IOERR:
      // A write that is refused for want of room may be reported as an error of the device.
      return code == SQLITE_IOERR_WRITE || code == SQLITE_IOERR_SHMSIZE ||
                     code == SQLITE_IOERR_FSYNC || code == SQLITE_IOERR_TRUNCATE
                 ? absl::ResourceExhaustedError(message)
                 : absl::UnavailableError(message);
    case SQLITE_CONSTRAINT:
      return absl::AlreadyExistsError(message);
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::DataLossError(message);
    default:
      return absl::InternalError(message);
  }
}

// SQLite gives the files beside it the same rights.
absl::Status MakePrivate(const std::string& path) {
  const FileDescriptor file(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!file.valid()) return StatusOfErrno(errno, "opening the database");
  if (fchmod(file.number(), 0600) != 0) return StatusOfErrno(errno, "rights of the database");
  return absl::OkStatus();
}

class SqliteStatement final : public Statement {
 public:
  explicit SqliteStatement(sqlite3_stmt* statement) : statement_(statement) {}

  absl::Status Bind(int number, int64_t value) override {
    return StatusOfBinding(sqlite3_bind_int64(statement_.get(), number, value));
  }
  absl::Status Bind(int number, const std::string& value) override {
    return StatusOfBinding(sqlite3_bind_blob64(statement_.get(), number, value.data(), value.size(),
                                               SQLITE_TRANSIENT));
  }

  absl::StatusOr<bool> Step() override {
    const int code = sqlite3_step(statement_.get());
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    return StatusOfSqlite(sqlite3_db_handle(statement_.get()));
  }

  absl::Status Run(bool /*behind*/) override {
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const bool row, Step());
      if (!row) return absl::OkStatus();
    }
  }

  int64_t Integer(int column) const override {
    return sqlite3_column_int64(statement_.get(), column);
  }
  std::string Bytes(int column) const override {
    const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
    const int size = sqlite3_column_bytes(statement_.get(), column);
    return data == nullptr ? std::string() : std::string(data, static_cast<size_t>(size));
  }

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };

  absl::Status StatusOfBinding(int code) const {
    if (code == SQLITE_OK) return absl::OkStatus();
    return StatusOfSqlite(sqlite3_db_handle(statement_.get()));
  }

  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

}  // namespace

void SqliteDatabase::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

absl::StatusOr<SqliteDatabase> SqliteDatabase::Open(const std::string& path) {
  RILIEVO_RETURN_IF_ERROR(MakePrivate(path));
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(path.c_str(), &handle,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  SqliteDatabase database(handle);
  if (code != SQLITE_OK) return StatusOfSqlite(handle);
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyMilliseconds);
  // How pages are given back is settled before the first one is written.
  RILIEVO_RETURN_IF_ERROR(
      database.Execute("PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL;"
                       "PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON;"));
  return database;
}

absl::StatusOr<int64_t> SqliteDatabase::Version() { return Number("PRAGMA user_version"); }

absl::Status SqliteDatabase::Make(int version, const char* schema) {
  return Execute(absl::StrCat("BEGIN; ", schema, "; PRAGMA user_version = ", version, "; COMMIT;"));
}

absl::StatusOr<Query> SqliteDatabase::Prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    return StatusOfSqlite(database_.get());
  }
  return Query(std::make_unique<SqliteStatement>(statement));
}

absl::Status SqliteDatabase::Execute(const std::string& sql) {
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) {
    return absl::OkStatus();
  }
  const absl::Status status = StatusOfSqlite(database_.get());
  // A transaction that failed half-way must not stay open.
  if (sqlite3_get_autocommit(database_.get()) == 0) {
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
  return status;
}

absl::Status SqliteDatabase::Transact(const std::function<absl::Status()>& body) {
  RILIEVO_RETURN_IF_ERROR(Execute("BEGIN IMMEDIATE"));
  absl::Status done = body();
  if (done.ok()) return Execute("COMMIT");
  // Some failures have ended the transaction already.
  if (sqlite3_get_autocommit(database_.get()) == 0) Execute("ROLLBACK").IgnoreError();
  return done;
}

absl::Status SqliteDatabase::Shrink() {
  RILIEVO_RETURN_IF_ERROR(Execute("PRAGMA incremental_vacuum"));
  return Execute("PRAGMA wal_checkpoint(TRUNCATE)");
}

int SqliteDatabase::Changes() const { return sqlite3_changes(database_.get()); }

}  // namespace rilievo
