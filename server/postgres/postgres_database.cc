#include "server/postgres/postgres_database.h"

#include <libpq-fe.h>
#include <poll.h>

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
constexpr char kLock[] = "SELECT pg_advisory_xact_lock(7269396576)";
constexpr char kUnflushed[] = "SET LOCAL synchronous_commit = off";
// A transaction of its own, which is on disk, as all before it, when it is answered; where there
// are synchronous standbys, there too.
constexpr char kFlush[] = "SELECT pg_logical_emit_message(true, 'rilievo', '')";
// A connection that failed is not tried again for so long: whoever waits for one waits no longer.
constexpr std::chrono::milliseconds kPause{250};

// What is waited for, at most. A server that stops in the middle of a transaction, with its machine
// or its network, is cut off, or it would hold up all others.
// A plan that was made while a table was small is used when it has grown.
constexpr char kSession[] =
    "SET enable_seqscan = off; SET jit = off;"
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

// Between two statements a server says nothing, unless that it ends.
bool IsAlive(PGconn* connection) {
  pollfd socket{.fd = PQsocket(connection), .events = POLLIN, .revents = 0};
  while (!IsBroken(connection) && poll(&socket, 1, 0) > 0) {
    if (PQconsumeInput(connection) != 1) return false;
  }
  return !IsBroken(connection);
}

absl::Status StatusOfResult(const PGconn* connection, const PGresult* result) {
  const ExecStatusType status = PQresultStatus(result);
  if (status != PGRES_FATAL_ERROR) return absl::OkStatus();
  const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  if (IsBroken(connection) || state == nullptr) return absl::UnavailableError(WordsOf(connection));
  return StatusOfState(
      state, absl::StrCat("database: ", PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY)));
}

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
      RILIEVO_RETURN_IF_ERROR(database_->Send(sql_, parameters_));
      RILIEVO_ASSIGN_OR_RETURN(result_, database_->Collect());
    }
    return ++row_ < PQntuples(result_.get());
  }

  absl::Status Run(bool behind) override {
    if (result_) return absl::OkStatus();
    if (behind && database_->in_transaction_) return database_->Send(sql_, parameters_);
    return Step().status();
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
  if (connection_ && IsAlive(connection_.get())) return absl::OkStatus();
  if (std::chrono::steady_clock::now() < next_attempt_) return failure_;
  prepared_.clear();
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
    if (PQresultStatus(set.get()) == PGRES_COMMAND_OK &&
        PQenterPipelineMode(connection_.get()) == 1) {
      return absl::OkStatus();
    }
  }
  failure_ = absl::UnavailableError(WordsOf(connection_.get()));
  next_attempt_ = std::chrono::steady_clock::now() + kPause;
  connection_.reset();
  return failure_;
}

absl::Status PostgresDatabase::Note(absl::Status status) {
  if (in_transaction_ && failed_.ok()) failed_ = status;
  return in_transaction_ ? failed_ : status;
}

absl::Status PostgresDatabase::Send(const std::string& sql,
                                    const std::vector<Parameter>& parameters) {
  RILIEVO_RETURN_IF_ERROR(Note(in_transaction_ ? absl::OkStatus() : Connect()));
  const size_t count = parameters.size();
  std::vector<Oid> types(count);
  std::vector<const char*> values(count);
  std::vector<int> lengths(count), formats(count, kBinary);
  for (size_t i = 0; i < count; ++i) {
    types[i] = parameters[i].integer ? kInteger : kBytes;
    values[i] = parameters[i].bytes.data();
    lengths[i] = static_cast<int>(parameters[i].bytes.size());
  }
  PGconn* const connection = connection_.get();
  const int size = static_cast<int>(count);
  const auto [known, first] = prepared_.try_emplace(sql, absl::StrCat("s", names_));
  const char* const name = known->second.c_str();
  if (first) {
    ++names_;
    sent_.push_back(sql);
    if (PQsendPrepare(connection, name, sql.c_str(), size, types.data()) != 1) return GiveUp();
  }
  sent_.emplace_back();
  const int sent = PQsendQueryPrepared(connection, name, size, values.data(), lengths.data(),
                                       formats.data(), kBinary);
  return sent == 1 ? absl::OkStatus() : GiveUp();
}

absl::Status PostgresDatabase::GiveUp() {
  const absl::Status status = absl::UnavailableError(WordsOf(connection_.get()));
  connection_.reset();
  sent_.clear();
  return Note(status);
}

absl::StatusOr<PostgresDatabase::Result> PostgresDatabase::Collect() {
  PGconn* const connection = connection_.get();
  if (PQpipelineSync(connection) != 1) return GiveUp();
  absl::Status status;
  Result last;
  for (size_t answered = 0;;) {
    Result result(PQgetResult(connection));
    if (!result) {  // the end of one answer, or of a connection
      if (IsBroken(connection)) return GiveUp();
      ++answered;
      continue;
    }
    const ExecStatusType kind = PQresultStatus(result.get());
    if (kind == PGRES_PIPELINE_SYNC) break;
    status.Update(StatusOfResult(connection, result.get()));
    if (kind != PGRES_COMMAND_OK && kind != PGRES_TUPLES_OK) continue;
    if (answered < sent_.size()) sent_[answered].clear();
    last = std::move(result);
  }
  // What followed an error was not looked at.
  for (const std::string& sql : sent_) prepared_.erase(sql);
  sent_.clear();
  RILIEVO_RETURN_IF_ERROR(Note(status));
  if (!absl::SimpleAtoi(PQcmdTuples(last.get()), &changes_)) changes_ = 0;
  return last;
}

absl::StatusOr<Query> PostgresDatabase::Prepare(const std::string& sql) {
  return Query(std::make_unique<PostgresStatement>(this, sql));
}

absl::Status PostgresDatabase::Execute(const std::string& sql) {
  if (!in_transaction_) RILIEVO_RETURN_IF_ERROR(Connect());
  if (!sent_.empty()) RILIEVO_RETURN_IF_ERROR(Collect().status());
  RILIEVO_RETURN_IF_ERROR(Note(absl::OkStatus()));
  // A pipeline takes one statement at a time.
  PGconn* const connection = connection_.get();
  if (PQexitPipelineMode(connection) != 1) return Note(absl::InternalError(WordsOf(connection)));
  const Result result(PQexec(connection, sql.c_str()));
  absl::Status done = StatusOfResult(connection, result.get());
  if (PQenterPipelineMode(connection) != 1)
    done.Update(absl::UnavailableError(WordsOf(connection)));
  return Note(std::move(done));
}

absl::Status PostgresDatabase::Transact(const std::function<absl::Status()>& body) {
  return TransactFrom({"BEGIN", kUnflushed, kLock}, {"COMMIT", kFlush}, body);
}

absl::Status PostgresDatabase::TransactBesideOthers(const std::function<absl::Status()>& body) {
  return TransactFrom({"BEGIN"}, {"COMMIT"}, body);
}

absl::Status PostgresDatabase::TransactUnflushed(const std::function<absl::Status()>& body) {
  return TransactFrom({"BEGIN", kUnflushed}, {"COMMIT"}, body);
}

absl::Status PostgresDatabase::TransactFrom(const std::vector<std::string>& begin,
                                            const std::vector<std::string>& end,
                                            const std::function<absl::Status()>& body) {
  RILIEVO_RETURN_IF_ERROR(Connect());
  in_transaction_ = true;
  failed_ = absl::OkStatus();
  for (const std::string& sql : begin) Send(sql).IgnoreError();
  // What the body does while it waits for its own first answer is done with the lock held.
  absl::Status done = begin.back() == kLock ? Collect().status() : failed_;
  if (done.ok()) done = body();
  if (done.ok()) {
    for (const std::string& sql : end) Send(sql).IgnoreError();
  }
  if (!sent_.empty()) Collect().IgnoreError();
  // What failed first is the reason of all else.
  if (!failed_.ok()) done = failed_;
  in_transaction_ = false;
  // A connection that broke has no transaction any more.
  if (!done.ok() && !IsBroken(connection_.get())) Execute("ROLLBACK").IgnoreError();
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
