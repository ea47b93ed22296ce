#include "server/store/database.h"

#include <gtest/gtest.h>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

constexpr char kSchema[] = "CREATE TABLE t(a INTEGER PRIMARY KEY, b BLOB UNIQUE)";

TEST(Database, KeepsRowsOverItsEnd) {
  const TestFolder test;
  const std::string bytes("x\0y", 3);
  {
    auto database = Database::Open(test / "db", 1, kSchema);
    ASSERT_TRUE(database.ok()) << database.status();
    auto query = database->Prepare("INSERT INTO t VALUES(?, ?)");
    ASSERT_TRUE(query.ok());
    ASSERT_TRUE(query->Bind(7).Bind(bytes).Run().ok());
    EXPECT_EQ(database->Changes(), 1);
  }
  auto database = Database::Open(test / "db", 1, kSchema);
  ASSERT_TRUE(database.ok());
  auto query = database->Prepare("SELECT a, b FROM t");
  ASSERT_TRUE(*query->Step());
  EXPECT_EQ(query->Integer(0), 7);
  EXPECT_EQ(query->Bytes(1), bytes);
  EXPECT_FALSE(*query->Step());
}

TEST(Database, IsSyncedAtEachTransaction) {
  const TestFolder test;
  auto database = Database::Open(test / "db", 1, kSchema);
  auto synchronous = database->Prepare("PRAGMA synchronous");
  ASSERT_TRUE(*synchronous->Step());
  EXPECT_EQ(synchronous->Integer(0), 2) << "FULL";
  auto journal = database->Prepare("PRAGMA journal_mode");
  ASSERT_TRUE(*journal->Step());
  EXPECT_EQ(journal->Bytes(0), "wal");
}

TEST(Database, ErrorsHaveTheirCodes) {
  const TestFolder test;
  auto database = Database::Open(test / "db", 1, kSchema);
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
  EXPECT_EQ(Database::Open(test / "db", 2, kSchema).status().code(),
            absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace rilievo
