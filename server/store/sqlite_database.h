// A database of one process in one file, by SQLite.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/database.h"

struct sqlite3;

namespace rilievo {

// Write-ahead log; every transaction is synced to disk before it returns. What another program
// holds is waited for, up to five seconds.
class SqliteDatabase final : public Database {
 public:
  // Opened or made, readable by its owner only.
  static absl::StatusOr<SqliteDatabase> Open(const std::string& path);

  // The version that Make() was given; 0 before.
  absl::StatusOr<int64_t> Version();

  // Makes the tables of a new database.
  absl::Status Make(int version, const char* schema);

  absl::StatusOr<Query> Prepare(const std::string& sql) override;
  absl::Status Execute(const std::string& sql) override;
  absl::Status Transact(const std::function<absl::Status()>& body) override;
  // Empties the write-ahead log too.
  absl::Status Shrink() override;
  int Changes() const override;

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  explicit SqliteDatabase(sqlite3* database) : database_(database) {}

  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace rilievo
