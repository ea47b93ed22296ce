// A database that many processes share, by PostgreSQL.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/database.h"

struct pg_conn;
struct pg_result;

namespace rilievo {

// One connection, made when it is first needed, and again when it broke. What is not within a
// transaction may be sent a second time then, so it must be such as may be repeated.
class PostgresDatabase final : public Database {
 public:
  // `url`: as libpq reads it (CheckPostgresUrl()).
  explicit PostgresDatabase(std::string url) : url_(std::move(url)) {}

  absl::StatusOr<Query> Prepare(const std::string& sql) override;
  absl::Status Execute(const std::string& sql) override;
  // One at a time of all who have the database, by an advisory lock that ends with the transaction.
  absl::Status Transact(const std::function<absl::Status()>& body) override;
  absl::Status TransactBesideOthers(const std::function<absl::Status()>& body) override;
  bool shared() const override { return true; }
  // Nothing: PostgreSQL does so by itself.
  absl::Status Shrink() override { return absl::OkStatus(); }
  int Changes() const override { return changes_; }

 private:
  friend class PostgresStatement;
  struct Finish {
    void operator()(pg_conn* connection) const;
  };
  struct Clear {
    void operator()(pg_result* result) const;
  };
  using Result = std::unique_ptr<pg_result, Clear>;
  // Integers as eight bytes, most significant first.
  struct Parameter {
    bool integer = false;
    std::string bytes;
  };

  absl::Status Connect();
  // Sends by `send`, anew over a new connection where the old one turned out to be broken.
  absl::StatusOr<Result> Send(const std::function<pg_result*(pg_conn*)>& send);
  absl::StatusOr<Result> Run(const std::string& sql, const std::vector<Parameter>& parameters);
  absl::Status TransactFrom(const std::string& begin, const std::function<absl::Status()>& body);

  const std::string url_;
  std::unique_ptr<pg_conn, Finish> connection_;
  bool in_transaction_ = false;
  int changes_ = 0;
  // After a connection that failed: how long the next ones fail at once, and with what.
  std::chrono::steady_clock::time_point next_attempt_{};
  absl::Status failure_;
};

// Whether a store is named by a URL of PostgreSQL: postgres:// or postgresql://.
bool IsPostgresUrl(const std::string& store);

// INVALID_ARGUMENT when libpq cannot read it, or when it holds a password, which all users of the
// machine could read in the list of processes. The message repeats nothing of it.
absl::Status CheckPostgresUrl(const std::string& url);

}  // namespace rilievo
