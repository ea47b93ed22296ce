// SQLite with statuses, and with durable writes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct sqlite3;
struct sqlite3_stmt;

namespace rilievo {

class Database;

// One run of a statement: parameters in, rows out. Lives shorter than its database.
class Query {
 public:
  Query& Bind(int64_t value);
  Query& Bind(const std::string& value);  // text or bytes

  // Whether there is a(nother) row. RESOURCE_EXHAUSTED when the disk is full or memory is short,
  // be it for a value that was bound, UNAVAILABLE when another program holds the database,
  // ALREADY_EXISTS when a value must be unique, DATA_LOSS when the file is damaged, else INTERNAL.
  absl::StatusOr<bool> Step();

  // To its end; rows are dropped.
  absl::Status Run();

  // Of the row, columns from 0.
  int64_t Integer(int column) const;
  std::string Bytes(int column) const;

 private:
  friend class Database;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  explicit Query(sqlite3_stmt* statement) : statement_(statement) {}

  Query& Bound(int code);

  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bound_ = 0;
  absl::Status binding_;  // of the first value that could not be bound
};

// Used by one thread at a time. Write-ahead log; every transaction is synced to disk before it
// returns. What another program holds is waited for, up to five seconds.
class Database {
 public:
  // Opened or made, readable by its owner only.
  static absl::StatusOr<Database> Open(const std::string& path);

  // The version that Make() was given; 0 before.
  absl::StatusOr<int64_t> Version();

  // Makes the tables of a new database.
  absl::Status Make(int version, const char* schema);

  absl::StatusOr<Query> Prepare(const std::string& sql);

  // Several statements without parameters.
  absl::Status Execute(const std::string& sql);

  // The first column of the first row, 0 when there is none.
  absl::StatusOr<int64_t> Number(const std::string& sql);

  // `body` as one transaction: all of it is on disk when this returns OK, else nothing of it.
  absl::Status Transact(const std::function<absl::Status()>& body);

  // Gives pages that hold nothing back to the disk, and empties the write-ahead log.
  absl::Status Shrink();

  // Rows that the latest statement changed.
  int Changes() const;

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  explicit Database(sqlite3* database) : database_(database) {}

  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace rilievo
