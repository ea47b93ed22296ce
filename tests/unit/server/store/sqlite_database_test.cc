#include "server/store/sqlite_database.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

// With a table t(a, b).
absl::StatusOr<SqliteDatabase> Opened(const std::string& path) {
  auto database = SqliteDatabase::Open(path);
  if (database.ok() && *database->Version() == 0) {
    EXPECT_TRUE(database->Make(1, "CREATE TABLE t(a INTEGER PRIMARY KEY, b BLOB UNIQUE)").ok());
  }
  return database;
}

TEST(SqliteDatabase, KeepsRowsOverItsEnd) {
  const TestFolder test;
  const std::string bytes("x\0y", 3);
  {
    auto database = Opened(test / "db");
    ASSERT_TRUE(database.ok()) << database.status();
    auto query = database->Prepare("INSERT INTO t VALUES(?, ?)");
    ASSERT_TRUE(query.ok());
    ASSERT_TRUE(query->Bind(7).Bind(bytes).Run().ok());
    EXPECT_EQ(database->Changes(), 1);
  }
  auto database = Opened(test / "db");
  ASSERT_TRUE(database.ok());
  auto query = database->Prepare("SELECT a, b FROM t");
  ASSERT_TRUE(*query->Step());
  EXPECT_EQ(query->Integer(0), 7);
  EXPECT_EQ(query->Bytes(1), bytes);
  EXPECT_FALSE(*query->Step());
}

TEST(SqliteDatabase, IsSyncedAtEachTransaction) {
  const TestFolder test;
  auto database = Opened(test / "db");
  auto synchronous = database->Prepare("PRAGMA synchronous");
  ASSERT_TRUE(*synchronous->Step());
  EXPECT_EQ(synchronous->Integer(0), 2) << "FULL";
  auto journal = database->Prepare("PRAGMA journal_mode");
  ASSERT_TRUE(*journal->Step());
  EXPECT_EQ(journal->Bytes(0), "wal");
}

TEST(SqliteDatabase, ErrorsHaveTheirCodes) {
  const TestFolder test;
  auto database = Opened(test / "db");
  EXPECT_FALSE(database->Prepare("SELECT nonsense").ok());
  ASSERT_TRUE(database->Execute("INSERT INTO t VALUES(1, 'x')").ok());
  EXPECT_EQ(database->Execute("INSERT INTO t VALUES(2, 'x')").code(),
            absl::StatusCode::kAlreadyExists);
  // As if the disk had no more room.
  ASSERT_TRUE(database->Execute("PRAGMA max_page_count = 10").ok());
  absl::Status full;
  for (int i = 0; i < 100 && full.ok(); ++i) {
    full = database->Execute("INSERT INTO t(b) VALUES(randomblob(4000))");
  }
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted) << full;
}

TEST(SqliteDatabase, AnotherProgramThatWritesIsWaitedFor) {
  const TestFolder test;
  auto database = Opened(test / "db");
  std::optional<SqliteDatabase> tool(*Opened(test / "db"));
  ASSERT_TRUE(tool->Execute("BEGIN IMMEDIATE").ok());
  std::jthread release([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    tool->Execute("COMMIT").IgnoreError();
  });
  EXPECT_TRUE(database->Execute("INSERT INTO t VALUES(1, 'x')").ok());
}

TEST(SqliteDatabase, ATransactionIsKeptWholeOrNotAtAll) {
  const TestFolder test;
  auto database = Opened(test / "db");
  const auto insert = [&](const absl::Status& end) {
    return database->Transact([&] {
      EXPECT_TRUE(database->Execute("INSERT INTO t(b) VALUES(randomblob(9))").ok());
      return end;
    });
  };
  EXPECT_EQ(insert(absl::CancelledError("no")).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(*database->Number("SELECT COUNT(*) FROM t"), 0);
  EXPECT_TRUE(insert(absl::OkStatus()).ok());
  EXPECT_EQ(*database->Number("SELECT COUNT(*) FROM t"), 1);
}

TEST(SqliteDatabase, AValueThatCannotBeBoundIsNotStored) {
  const TestFolder test;
  auto database = Opened(test / "db");
  EXPECT_FALSE(database->Prepare("SELECT 1")->Bind(1).Run().ok()) << "no such parameter";

  auto query = database->Prepare("INSERT INTO t(b) VALUES(?)");
  const int64_t limit = sqlite3_hard_heap_limit64(sqlite3_memory_used() + 10'000);
  const absl::Status stored = query->Bind(std::string(1'000'000, 'x')).Run();
  sqlite3_hard_heap_limit64(limit);
  EXPECT_TRUE(absl::IsResourceExhausted(stored)) << stored;
  EXPECT_EQ(*database->Number("SELECT COUNT(*) FROM t"), 0);
}

TEST(SqliteDatabase, IsItsOwnersAndShrinks) {
  const TestFolder test;
  auto database = Opened(test / "db");
  const auto rights = std::filesystem::status(test / "db").permissions();
  EXPECT_EQ(rights, std::filesystem::perms(0600));
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(database->Execute("INSERT INTO t(b) VALUES(randomblob(40000))").ok());
  }
  ASSERT_TRUE(database->Execute("DELETE FROM t").ok());
  ASSERT_TRUE(database->Shrink().ok());
  EXPECT_LT(std::filesystem::file_size(test / "db"), 100'000);
}

TEST(SqliteDatabase, DamageIsToldFromOtherErrors) {
  const TestFolder test;
  std::ofstream(test / "db") << std::string(10'000, 'x');
  EXPECT_TRUE(absl::IsDataLoss(SqliteDatabase::Open(test / "db").status()));
}

}  // namespace
}  // namespace rilievo
