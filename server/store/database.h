// SQLite with statuses, and with durable writes.
#pragma once

#include <cstdint>
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

  // Whether there is a(nother) row. RESOURCE_EXHAUSTED when the disk is full, ALREADY_EXISTS when a
  // value must be unique, else INTERNAL.
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

  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bound_ = 0;
};

// Used by one thread at a time. Write-ahead log; every transaction is synced to disk before it
// returns.
class Database {
 public:
  // Opened or made. `schema` makes the tables of `version`; `from_previous`, when given, makes them
  // of those of the version before. UNAVAILABLE when the tables are of another version.
  static absl::StatusOr<Database> Open(const std::string& path, int version, const char* schema,
                                       const char* from_previous = nullptr);

  absl::StatusOr<Query> Prepare(const char* sql);

  // Several statements without parameters.
  absl::Status Execute(const char* sql);

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
