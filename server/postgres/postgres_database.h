// A database that many processes share, by PostgreSQL.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/database.h"

struct pg_conn;
struct pg_result;

namespace rilievo {

// One connection, made when it is first needed, and again when it broke. Nothing is sent twice:
// what broke under a statement is UNAVAILABLE, though it may have been done.
//
// Statements are prepared when they are first used. Those of a transaction whose answer nobody
// waits for are sent together (libpq's pipeline): a transaction costs few journeys to the database.
class PostgresDatabase final : public Database {
 public:
  // `url`: as libpq reads it (CheckPostgresUrl()).
  explicit PostgresDatabase(std::string url) : url_(std::move(url)) {}

  absl::StatusOr<Query> Prepare(const std::string& sql) override;
  absl::Status Execute(const std::string& sql) override;
  // One at a time of all who have the database, by an advisory lock that ends with the transaction,
  // given up before the flush to disk, so that transactions that come together share one.
  absl::Status Transact(const std::function<absl::Status()>& body) override;
  absl::Status TransactBesideOthers(const std::function<absl::Status()>& body) override;
  absl::Status TransactUnflushed(const std::function<absl::Status()>& body) override;
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
  // Sends a statement; Collect() waits for the answers to all that were sent, and has the last one.
  absl::Status Send(const std::string& sql, const std::vector<Parameter>& parameters = {});
  absl::StatusOr<Result> Collect();
  // Of a connection that broke, or that nothing more can be sent over.
  absl::Status GiveUp();
  // OK, or what failed first within this transaction; anything later only follows from that.
  absl::Status Note(absl::Status status);
  // `end`: "COMMIT", and what follows it.
  absl::Status TransactFrom(const std::vector<std::string>& begin,
                            const std::vector<std::string>& end,
                            const std::function<absl::Status()>& body);

  const std::string url_;
  std::unique_ptr<pg_conn, Finish> connection_;
  std::map<std::string, std::string> prepared_;  // names of statements, by their SQL
  int names_ = 0;                                // that statements were given so far
  // What was sent and has no answer yet: the SQL of what is to be prepared, nothing of a statement.
  std::vector<std::string> sent_;
  bool in_transaction_ = false;
  absl::Status failed_;  // the first failure of this transaction
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
