// Stores of the test, whose clocks the test sets: in a folder, and in PostgreSQL with bytes there,
// in a folder or in S3.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_store.h"
#include "server/store/job_store.h"
#include "server/store/sqlite_database.h"
#include "tests/unit/server/postgres/test_postgres.h"
#include "tests/unit/server/s3/test_s3.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {

enum class StorePlace { kFolder, kPostgres, kPostgresAndFolder, kPostgresAndS3 };

class StoreFixture : public testing::Test {
 protected:
  explicit StoreFixture(StorePlace place) : place_(place) {
    settings_.clock = {.wall_ms = [this] { return wall_; },
                       .steady_ms = [this] { return steady_; }};
    settings_.report = [this](const std::string& line) { reports_.push_back(line); };
  }

  void SetUp() override {
    if (place_ != StorePlace::kFolder) {
      RILIEVO_TEST_POSTGRES(server);
      url_ = server->NewDatabase();
    }
    if (place_ == StorePlace::kPostgresAndS3) {
      RILIEVO_TEST_S3(bucket);
      blobs_url_ = bucket->NewUrl();
    } else if (place_ == StorePlace::kPostgresAndFolder) {
      blobs_url_ = "file:" + (test_ / "blobs");
    }
    Reopen();
  }

  void Reopen(const Retention& retention) {
    settings_.retention = retention;
    Reopen();
  }

  // Both clocks, as time passes.
  void Pass(int64_t ms) {
    wall_ += ms;
    steady_ += ms;
  }

  // The tables, beside a store or without one.
  JobTables Tables() {
    if (place_ == StorePlace::kFolder)
      return JobTables(*SqliteDatabase::Open(test_ / "store/jobs.db"));
    return JobTables(std::make_unique<PostgresDatabase>(url_));
  }

  // A statement on the database while no store has it.
  void Tamper(const std::string& sql) {
    store_.reset();
    ASSERT_TRUE(Tables().database().Execute(sql).ok());
  }

  // Counts of uses and bytes by owner, to be the same as when they are counted anew.
  std::string Counts() {
    store_.reset();
    JobTables tables = Tables();
    std::string text[2];
    for (std::string& now : text) {
      auto uses = *tables.database().Prepare("SELECT blob, owner, count FROM uses ORDER BY 1, 2");
      while (*uses.Step()) {
        absl::StrAppend(&now, uses.Bytes(0), " ", uses.Bytes(1), " ", uses.Integer(2), "\n");
      }
      const auto owners = *tables.Owners();
      for (const auto& [owner, bytes] : owners) {
        if (bytes != 0) absl::StrAppend(&now, owner, ": ", bytes, "\n");
      }
      EXPECT_TRUE(tables.Recount().ok());
    }
    EXPECT_EQ(text[0], text[1]);
    return text[1];
  }

  void Reopen() {
    store_.reset();
    auto opened = OpenOne();
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }

  absl::StatusOr<std::unique_ptr<JobStore>> OpenOne() {
    if (place_ == StorePlace::kFolder) return JobStore::Open(test_ / "store", settings_);
    return OpenPostgresStore(url_, blobs_url_, settings_);
  }

  std::string Blob(uint8_t value, size_t size = 10) {
    return *store_->blobs().Put({std::vector<uint8_t>(size, value)});
  }

  std::string Scan(uint8_t value, const std::string& owner = "") {
    const std::string scan = Blob(value);
    EXPECT_TRUE(store_->AddScan(owner, scan).ok());
    return scan;
  }

  StoredJob NewJob(const std::string& id, const std::string& owner = "") {
    StoredJob stored;
    stored.owner = owner;
    stored.client = "c";
    stored.header.set_point_count(20);
    stored.job.set_job_id(id);
    stored.job.set_request_id("r-" + id);
    stored.job.set_scan_id(Scan(1, owner));
    stored.job.set_state(v1::JOB_STATE_QUEUED);
    return stored;
  }

  static StoredJob Finished(StoredJob stored) {
    stored.job.set_state(v1::JOB_STATE_SUCCEEDED);
    return stored;
  }

  static std::vector<std::string> Ids(const std::vector<v1::Job>& jobs) {
    std::vector<std::string> ids;
    for (const auto& job : jobs) ids.push_back(job.job_id());
    return ids;
  }

  static constexpr int64_t kDay = 24 * 3'600'000;

  const StorePlace place_;
  TestFolder test_;
  std::string url_, blobs_url_ = "pg:";
  int64_t wall_ = 1'700'000'000'000, steady_ = 5'000;
  std::vector<std::string> reports_;
  StoreSettings settings_;
  std::unique_ptr<JobStore> store_;
};

// What holds of every store.
class JobStoreTest : public StoreFixture, public testing::WithParamInterface<StorePlace> {
 protected:
  JobStoreTest() : StoreFixture(GetParam()) {}
};

// What is about the files.
class FolderStoreTest : public StoreFixture {
 protected:
  FolderStoreTest() : StoreFixture(StorePlace::kFolder) {}
};

inline std::string NameOfPlace(const testing::TestParamInfo<StorePlace>& place) {
  const char* const names[] = {"Folder", "Postgres", "PostgresAndFolder", "PostgresAndS3"};
  return names[static_cast<int>(place.param)];
}

#define RILIEVO_OF_EVERY_STORE(fixture)                                                           \
  INSTANTIATE_TEST_SUITE_P(                                                                       \
      Of, fixture,                                                                                \
      testing::Values(StorePlace::kFolder, StorePlace::kPostgres, StorePlace::kPostgresAndFolder, \
                      StorePlace::kPostgresAndS3),                                                \
      NameOfPlace)

// Of what is the same wherever bytes are outside of the database.
#define RILIEVO_OF_EVERY_STORE_BUT_S3(fixture)                                                     \
  INSTANTIATE_TEST_SUITE_P(                                                                        \
      Of, fixture,                                                                                 \
      testing::Values(StorePlace::kFolder, StorePlace::kPostgres, StorePlace::kPostgresAndFolder), \
      NameOfPlace)

}  // namespace rilievo
