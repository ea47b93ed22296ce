// A store in a folder of the test, whose clocks the test sets.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/store/job_store.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {

class JobStoreTest : public testing::Test {
 protected:
  JobStoreTest() {
    settings_.clock = {.wall_ms = [this] { return wall_; },
                       .steady_ms = [this] { return steady_; }};
    settings_.report = [this](const std::string& line) { reports_.push_back(line); };
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

  // A statement on the database while no store has it.
  void Tamper(const std::string& sql) {
    store_.reset();
    ASSERT_TRUE(Database::Open(test_ / "store/jobs.db")->Execute(sql).ok());
  }

  // Counts of uses and bytes by owner, to be the same as when they are counted anew.
  std::string Counts() {
    store_.reset();
    JobTables tables(*Database::Open(test_ / "store/jobs.db"));
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
    auto opened = JobStore::Open(test_ / "store", settings_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
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

  TestFolder test_;
  int64_t wall_ = 1'700'000'000'000, steady_ = 5'000;
  std::vector<std::string> reports_;
  StoreSettings settings_;
  std::unique_ptr<JobStore> store_;
};

}  // namespace rilievo
