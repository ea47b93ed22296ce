#include "server/postgres/postgres_database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/postgres/postgres_schema.h"
#include "tests/unit/server/postgres/test_postgres.h"

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::Not;

class PostgresDatabaseTest : public testing::Test {
 protected:
  void SetUp() override {
    RILIEVO_TEST_POSTGRES(server);
    server_ = server;
    url_ = server->NewDatabase();
    ASSERT_TRUE(PostgresDatabase(url_)
                    .Execute("CREATE TABLE t(a BIGINT PRIMARY KEY, b BYTEA UNIQUE)")
                    .ok());
  }

  TestPostgres* server_ = nullptr;
  std::string url_;
};

TEST_F(PostgresDatabaseTest, KeepsIntegersAndBytes) {
  const std::string bytes("x\0'\xff", 4);
  for (const int64_t number : {int64_t{0}, int64_t{-1}, INT64_MIN, INT64_MAX}) {
    PostgresDatabase database(url_);
    auto insert = *database.Prepare("INSERT INTO t VALUES($1, $2)");
    ASSERT_TRUE(insert.Bind(number).Bind(bytes + std::to_string(number)).Run().ok());
    EXPECT_EQ(database.Changes(), 1);
    auto select = *database.Prepare("SELECT a, b, CAST(-3 AS INTEGER) FROM t WHERE a = $1");
    ASSERT_TRUE(*select.Bind(number).Step());
    EXPECT_EQ(select.Integer(0), number);
    EXPECT_EQ(select.Bytes(1), bytes + std::to_string(number));
    EXPECT_EQ(select.Integer(2), -3);
    EXPECT_FALSE(*select.Step());
  }
}

TEST_F(PostgresDatabaseTest, ErrorsHaveTheirCodes) {
  PostgresDatabase database(url_);
  EXPECT_EQ(database.Execute("SELECT nonsense").code(), absl::StatusCode::kInternal);
  ASSERT_TRUE(database.Execute("INSERT INTO t VALUES(1, 'x')").ok());
  EXPECT_EQ(database.Execute("INSERT INTO t VALUES(2, 'x')").code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(PostgresDatabase("postgres:///none?user=rilievo&host=/nowhere")
                .Number("SELECT 1")
                .status()
                .code(),
            absl::StatusCode::kUnavailable);
  ASSERT_TRUE(database.Execute("SET lock_timeout = '100ms'").ok());
  PostgresDatabase other(url_);
  const absl::Status waited = other.Transact(
      [&]() -> absl::Status { return database.Transact([] { return absl::OkStatus(); }); });
  EXPECT_TRUE(absl::IsUnavailable(waited)) << waited;
}

TEST_F(PostgresDatabaseTest, ATransactionIsKeptWholeOrNotAtAll) {
  PostgresDatabase database(url_);
  const auto insert = [&](const absl::Status& end) {
    return database.Transact([&] {
      EXPECT_TRUE(database.Execute("INSERT INTO t VALUES(1, 'x')").ok());
      return end;
    });
  };
  EXPECT_EQ(insert(absl::CancelledError("no")).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 0);
  EXPECT_TRUE(insert(absl::OkStatus()).ok());
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 1);
  // An error that its body hides loses the rest of it, and is not taken for success.
  const absl::Status hidden = database.Transact([&] {
    EXPECT_TRUE(database.Execute("INSERT INTO t VALUES(2, 'y')").ok());
    EXPECT_FALSE(database.Execute("SELECT nonsense").ok());
    return absl::OkStatus();
  });
  EXPECT_FALSE(hidden.ok());
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 1);
}

TEST_F(PostgresDatabaseTest, WhatIsPostedIsDoneInOrderOrFailsTheWhole) {
  PostgresDatabase database(url_);
  const auto insert = [&](int64_t number) {
    auto query = *database.Prepare("INSERT INTO t VALUES($1, CAST($1 AS TEXT)::BYTEA)");
    return query.Bind(number).Post();
  };
  const absl::Status kept = database.Transact([&]() -> absl::Status {
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(insert(i).ok());
    EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 3);
    EXPECT_TRUE(insert(3).ok());
    EXPECT_TRUE(
        database.Execute("INSERT INTO t VALUES(4, 'four'); DELETE FROM t WHERE a = 0").ok());
    return insert(5);
  });
  EXPECT_TRUE(kept.ok()) << kept;
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 5);
  const absl::Status twice = database.Transact([&]() -> absl::Status {
    EXPECT_TRUE(insert(6).ok());
    EXPECT_TRUE(insert(5).ok()) << "nobody has asked yet";
    return absl::NotFoundError("as it seems to who does not know of it");
  });
  EXPECT_TRUE(absl::IsAlreadyExists(twice)) << twice;
  EXPECT_TRUE(absl::IsAlreadyExists(database.Transact([&] { return insert(5); })));
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 5);
  EXPECT_TRUE(insert(6).ok()) << "outside of a transaction too";
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 6);
}

// Whoever asked knows best whether it may be done twice.
TEST_F(PostgresDatabaseTest, NothingIsSentTwice) {
  PostgresDatabase database(url_), other(url_);
  ASSERT_TRUE(database.Execute("CREATE SEQUENCE done").ok());
  const auto cut = database.Number(
      "SELECT CAST(pg_terminate_backend(pg_backend_pid()) AS INTEGER) + nextval('done')");
  EXPECT_TRUE(absl::IsUnavailable(cut.status())) << cut.status();
  EXPECT_EQ(*other.Number("SELECT last_value FROM done"), 1);
  EXPECT_EQ(*database.Number("SELECT 5"), 5) << "over a new connection";
  ASSERT_TRUE(
      other
          .Execute("SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity WHERE pid <>"
                   " pg_backend_pid() AND datname = current_database()")
          .ok());
  EXPECT_TRUE(database.Execute("INSERT INTO t VALUES(1, 'x')").ok())
      << "a connection that broke while nobody used it is noticed";
}

TEST_F(PostgresDatabaseTest, OneTransactionAtATime) {
  std::atomic<int> within{0}, most{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      PostgresDatabase database(url_);
      for (int round = 0; round < 20; ++round) {
        const absl::Status done = database.Transact([&] {
          most = std::max(most.load(), ++within);
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
          --within;
          return absl::OkStatus();
        });
        EXPECT_TRUE(done.ok()) << done;
      }
    });
  }
  threads.clear();
  EXPECT_EQ(most, 1);
}

TEST_F(PostgresDatabaseTest, AKilledServerLosesNothingThatWasAcknowledged) {
  PostgresDatabase database(url_);
  ASSERT_TRUE(database.Execute("INSERT INTO t VALUES(1, 'x')").ok());
  const absl::Status cut = database.Transact([&] {
    EXPECT_TRUE(database.Execute("INSERT INTO t VALUES(2, 'y')").ok());
    server_->Kill();
    return absl::OkStatus();
  });
  EXPECT_TRUE(absl::IsUnavailable(cut)) << cut;
  EXPECT_TRUE(absl::IsUnavailable(database.Number("SELECT 1").status()));
  server_->Start();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM t"), 1) << "over a new connection";
}

TEST_F(PostgresDatabaseTest, ManyServersMakeTheTablesOnce) {
  std::vector<std::jthread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&] {
      PostgresDatabase database(url_);
      const absl::Status made = MakePostgresTables(&database);
      EXPECT_TRUE(made.ok()) << made;
    });
  }
  threads.clear();
  PostgresDatabase database(url_);
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM rilievo_schema"),
            *database.Number("SELECT MAX(version) FROM rilievo_schema"));
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM jobs"), 0);
}

// Who comes to its parts reads both tables, as PartQueue::Take does.
TEST_F(PostgresDatabaseTest, TablesAreChangedUnderWorkers) {
  PostgresDatabase database(url_), worker(url_), other(url_);
  ASSERT_TRUE(MakePostgresTables(&database).ok());
  ASSERT_TRUE(database
                  .Execute("DROP VIEW reserved; ALTER TABLE queue DROP owner, DROP parts_bytes;"
                           " ALTER TABLE job_parts DROP other, DROP other_by;"
                           " DELETE FROM rilievo_schema WHERE version = 4")
                  .ok());
  std::future<absl::Status> made;
  const absl::Status taken = worker.TransactUnflushed([&]() -> absl::Status {
    EXPECT_TRUE(worker.Number("SELECT COUNT(*) FROM queue").ok());
    made = std::async(std::launch::async, [&] { return MakePostgresTables(&database); });
    while (*other.Number("SELECT COUNT(*) FROM pg_locks WHERE NOT granted") == 0 &&
           made.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) {
    }
    return worker.Number("SELECT COUNT(*) FROM job_parts").status();
  });
  EXPECT_TRUE(taken.ok()) << taken;
  const absl::Status changed = made.get();
  EXPECT_TRUE(changed.ok()) << changed;
}

TEST_F(PostgresDatabaseTest, TablesOfALaterVersionAreUsedIfTheyAllowIt) {
  PostgresDatabase database(url_);
  ASSERT_TRUE(MakePostgresTables(&database).ok());
  ASSERT_TRUE(database.Execute("INSERT INTO rilievo_schema VALUES(98, 1)").ok());
  EXPECT_TRUE(MakePostgresTables(&database).ok()) << "the next version beside this one";
  ASSERT_TRUE(database.Execute("INSERT INTO rilievo_schema VALUES(99, 99)").ok());
  const absl::Status refused = MakePostgresTables(&database);
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("newer rilievod"));
}

TEST(PostgresUrl, IsTakenWithoutAPassword) {
  for (const char* url :
       {"postgres://u@h/d", "postgresql:///d?host=/run/x&user=u", "postgres://?service=s",
        "postgres://u@a:1,b:2/d?sslmode=verify-full", "postgres://u@h/d?passfile=/etc/pass"}) {
    EXPECT_TRUE(IsPostgresUrl(url)) << url;
    EXPECT_TRUE(CheckPostgresUrl(url).ok()) << url << CheckPostgresUrl(url);
  }
  EXPECT_FALSE(IsPostgresUrl("/var/lib/rilievo"));
  for (const char* url :
       {"postgres://u:hunter2@h/d", "postgres://u@h/d?password=hunter2",
        "postgres://u@h/d?sslpassword=hunter2", "postgres://u:hunter2@h/d?nonsense=1"}) {
    const absl::Status refused = CheckPostgresUrl(url);
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << url;
    EXPECT_THAT(std::string(refused.message()), Not(HasSubstr("hunter2")));
  }
}

}  // namespace
}  // namespace rilievo
