#include "server/postgres/postgres_database.h"

#include <libpq-fe.h>

#include <cstring>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Of pg_type; they never change.
constexpr Oid kBytes = 17, kInteger = 20;
constexpr int kBinary = 1;
// Of this project's stores; any number will do.
constexpr char kLock[] = "BEGIN; SELECT pg_advisory_xact_lock(7269396576)";
// A connection that failed is not tried again for so long: whoever waits for one waits no longer.
constexpr std::chrono::milliseconds kPause{250};

// What is waited for, at most. A server that stops in the middle of a transaction, with its machine
// or its network, is cut off, or it would hold up all others.
constexpr char kSession[] =
    "SET lock_timeout = '10s'; SET statement_timeout = '60s';"
    "SET idle_in_transaction_session_timeout = '10s'";

absl::Status StatusOfState(std::string_view state, const std::string& message) {
  const std::string_view kind = state.substr(0, 2);
  if (state == "23505") return absl::AlreadyExistsError(message);
  if (state == "53100" || state == "53200") return absl::ResourceExhaustedError(message);
  if (kind == "XX") return absl::DataLossError(message);
  // Connections; resources; operators at work; a server that recovers or is a standby; a lock or a
  // statement that took too long, or a deadlock: it may pass.
  for (const char* passing : {"08", "53", "57", "55", "40", "25"}) {
    if (kind == passing) return absl::UnavailableError(message);
  }
  return absl::InternalError(message);
}

// The first line of what libpq says of a connection; there is no password in it.
std::string WordsOf(const PGconn* connection) {
  const absl::string_view text = PQerrorMessage(connection);
  return absl::StrCat("database: ", text.substr(0, text.find('\n')));
}

std::string BytesOfInteger(int64_t value) {
  std::string bytes(8, '\0');
  for (int i = 0; i < 8; ++i) {
    bytes[static_cast<size_t>(i)] = static_cast<char>(static_cast<uint64_t>(value) >> (56 - 8 * i));
  }
  return bytes;
}

bool IsBroken(const PGconn* connection) { return PQstatus(connection) != CONNECTION_OK; }

}  // namespace

// All rows come with the first step.
class PostgresStatement final : public Statement {
 public:
  PostgresStatement(PostgresDatabase* database, std::string sql)
      : database_(database), sql_(std::move(sql)) {}

  absl::Status Bind(int /*number*/, int64_t value) override {
    parameters_.push_back({true, BytesOfInteger(value)});
    return absl::OkStatus();
  }
  absl::Status Bind(int /*number*/, const std::string& value) override {
    parameters_.push_back({false, value});
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Step() override {
    if (!result_) {
      RILIEVO_ASSIGN_OR_RETURN(result_, database_->Run(sql_, parameters_));
    }
    return ++row_ < PQntuples(result_.get());
  }

  // Of two, four or eight bytes.
  int64_t Integer(int column) const override {
    const std::string bytes = Bytes(column);
    uint64_t value = bytes.empty() || bytes[0] >= 0 ? 0 : ~uint64_t{0};
    for (const char byte : bytes) value = value << 8 | static_cast<uint8_t>(byte);
    return static_cast<int64_t>(value);
  }
  std::string Bytes(int column) const override {
    return {PQgetvalue(result_.get(), row_, column),
            static_cast<size_t>(PQgetlength(result_.get(), row_, column))};
  }

 private:
  PostgresDatabase* const database_;
  const std::string sql_;
  std::vector<PostgresDatabase::Parameter> parameters_;
  PostgresDatabase::Result result_;
  int row_ = -1;
};

void PostgresDatabase::Finish::operator()(pg_conn* connection) const { PQfinish(connection); }
void PostgresDatabase::Clear::operator()(pg_result* result) const { PQclear(result); }

absl::Status PostgresDatabase::Connect() {
  if (connection_ && !IsBroken(connection_.get())) return absl::OkStatus();
  if (in_transaction_) return absl::UnavailableError("database: the connection broke");
  if (std::chrono::steady_clock::now() < next_attempt_) return failure_;
  // What stands before the URL is what holds where that does not say otherwise.
  const char* const names[] = {"connect_timeout",  "tcp_user_timeout", "keepalives_idle",
                               "application_name", "dbname",           nullptr};
  const char* const values[] = {"5", "15000", "10", "rilievod", url_.c_str(), nullptr};
  connection_.reset(PQconnectdbParams(names, values, /*expand_dbname=*/1));
  if (!connection_) return absl::ResourceExhaustedError("database: no memory for a connection");
  PQsetNoticeProcessor(
      connection_.get(), [](void*, const char*) {}, nullptr);
  if (!IsBroken(connection_.get())) {
    const Result set(PQexec(connection_.get(), kSession));
    if (PQresultStatus(set.get()) == PGRES_COMMAND_OK) return absl::OkStatus();
  }
  failure_ = absl::UnavailableError(WordsOf(connection_.get()));
  next_attempt_ = std::chrono::steady_clock::now() + kPause;
  connection_.reset();
  return failure_;
}

absl::StatusOr<PostgresDatabase::Result> PostgresDatabase::Send(
    const std::function<pg_result*(pg_conn*)>& send) {
  for (bool again = false;; again = true) {
    RILIEVO_RETURN_IF_ERROR(Connect());
    Result result(send(connection_.get()));
    const ExecStatusType status = PQresultStatus(result.get());
    if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) {
      if (!absl::SimpleAtoi(PQcmdTuples(result.get()), &changes_)) changes_ = 0;
      return result;
    }
    const bool broken = IsBroken(connection_.get());
    if (broken && !in_transaction_ && !again) continue;
    const char* state = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
    if (broken || state == nullptr) return absl::UnavailableError(WordsOf(connection_.get()));
    return StatusOfState(
        state,
        absl::StrCat("database: ", PQresultErrorField(result.get(), PG_DIAG_MESSAGE_PRIMARY)));
  }
}

absl::StatusOr<PostgresDatabase::Result> PostgresDatabase::Run(
    const std::string& sql, const std::vector<Parameter>& parameters) {
  const size_t count = parameters.size();
  std::vector<Oid> types(count);
  std::vector<const char*> values(count);
  std::vector<int> lengths(count), formats(count, kBinary);
  for (size_t i = 0; i < count; ++i) {
    types[i] = parameters[i].integer ? kInteger : kBytes;
    values[i] = parameters[i].bytes.data();
    lengths[i] = static_cast<int>(parameters[i].bytes.size());
  }
  return Send([&](pg_conn* connection) {
    return PQexecParams(connection, sql.c_str(), static_cast<int>(count), types.data(),
                        values.data(), lengths.data(), formats.data(), kBinary);
  });
}

absl::StatusOr<Query> PostgresDatabase::Prepare(const std::string& sql) {
  return Query(std::make_unique<PostgresStatement>(this, sql));
}

absl::Status PostgresDatabase::Execute(const std::string& sql) {
  return Send([&](pg_conn* connection) { return PQexec(connection, sql.c_str()); }).status();
}

absl::Status PostgresDatabase::Transact(const std::function<absl::Status()>& body) {
  return TransactFrom(kLock, body);
}

absl::Status PostgresDatabase::TransactBesideOthers(const std::function<absl::Status()>& body) {
  return TransactFrom("BEGIN", body);
}

absl::Status PostgresDatabase::TransactFrom(const std::string& begin,
                                            const std::function<absl::Status()>& body) {
  absl::Status done = Execute(begin);
  in_transaction_ = true;
  if (done.ok()) done = body();
  if (done.ok()) {
    const auto committed = Send([](pg_conn* connection) { return PQexec(connection, "COMMIT"); });
    in_transaction_ = false;
    RILIEVO_RETURN_IF_ERROR(committed.status());
    // What failed within, though nobody said so, takes all the rest along.
    if (std::string_view(PQcmdStatus(committed->get())) == "COMMIT") return absl::OkStatus();
    return absl::InternalError("database: the transaction was rolled back");
  }
  // A connection that broke has no transaction any more.
  if (connection_ && !IsBroken(connection_.get())) Execute("ROLLBACK").IgnoreError();
  in_transaction_ = false;
  return done;
}

bool IsPostgresUrl(const std::string& store) {
  return absl::StartsWith(store, "postgres://") || absl::StartsWith(store, "postgresql://");
}

absl::Status CheckPostgresUrl(const std::string& url) {
  char* words = nullptr;
  const std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)> options(
      PQconninfoParse(url.c_str(), &words), PQconninfoFree);
  PQfreemem(words);
  if (!options) {
    return absl::InvalidArgumentError(
        "store: this is not a URL that PostgreSQL reads; give for example "
        "postgres://rilievo@db.example.org/rilievo or postgres://?service=rilievo");
  }
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    const bool secret = std::strstr(option->keyword, "password") != nullptr &&
                        std::strcmp(option->keyword, "passfile") != 0;
    if (!secret || option->val == nullptr || *option->val == '\0') continue;
    return absl::InvalidArgumentError(
        "store: the URL holds a password, which all users of this machine can read in its list of "
        "processes; put it into ~/.pgpass, a file of PGPASSFILE, or a service file, and leave it "
        "out here");
  }
  return absl::OkStatus();
}

}  // namespace rilievo
