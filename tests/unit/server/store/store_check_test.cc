#include "server/store/store_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "server/store/content_name.h"
#include "server/store/job_store.h"
#include "server/store/store_backup.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

// A store with jobs a and b, finished, and c, waiting, on one scan.
class StoreCheckTest : public testing::Test {
 protected:
  StoreCheckTest() {
    auto store = Open();
    scan_ = *store->blobs().Put({std::vector<uint8_t>(50, 1)});
    EXPECT_TRUE(store->AddScan("ann", scan_).ok());
    for (const std::string id : {"a", "b", "c"}) {
      StoredJob stored{.owner = "ann", .client = "ann"};
      stored.job.set_job_id(id);
      stored.job.set_request_id(id);
      stored.job.set_scan_id(scan_);
      stored.job.set_state(v1::JOB_STATE_QUEUED);
      EXPECT_TRUE(store->Insert(stored).ok());
      if (id == "c") continue;
      stored.job.set_state(v1::JOB_STATE_SUCCEEDED);
      EXPECT_TRUE(store->Finish(stored, {{static_cast<uint8_t>(id[0]), 2, 3}}).ok());
    }
  }

  std::unique_ptr<JobStore> Open(const std::string& folder = "store") {
    auto store = JobStore::Open(test_ / folder);
    EXPECT_TRUE(store.ok()) << store.status();
    return *std::move(store);
  }

  int64_t Check(bool repair) {
    lines_.clear();
    const auto left = CheckStore(test_ / "store", repair,
                                 [&](const std::string& line) { lines_ += line + "\n"; });
    EXPECT_TRUE(left.ok()) << left.status();
    return left.value_or(-1);
  }

  void Flip(const std::string& blob) {
    std::fstream file(test_ / "store/blobs/" + blob, std::ios::in | std::ios::out);
    file.put('!');
  }

  TestFolder test_;
  std::string scan_, lines_;
};

TEST_F(StoreCheckTest, AWholeStoreHasNoProblem) {
  EXPECT_EQ(Check(false), 0);
  EXPECT_EQ(lines_, "");
  const auto in_use = Open();
  EXPECT_EQ(CheckStore(test_ / "store", false, [](const std::string&) {}).status().code(),
            absl::StatusCode::kUnavailable);
}

TEST_F(StoreCheckTest, DamagedBlobsAreToldAndSetAside) {
  Flip(scan_);
  Flip(ContentNameOf(std::string("a\2\3")));
  EXPECT_GE(Check(false), 3);
  EXPECT_THAT(lines_, HasSubstr("job a: its surface"));
  EXPECT_EQ(Check(true), 0);
  EXPECT_EQ(Check(false), 0);
  EXPECT_TRUE(std::filesystem::exists(test_ / "store/damaged/" + scan_));
  auto store = Open();
  EXPECT_TRUE(absl::IsDataLoss(store->Get("ann", "a").status()));
  EXPECT_TRUE(store->Get("ann", "b").ok());
  EXPECT_TRUE(absl::IsNotFound(store->BytesOfScan("ann", scan_).status()));
}

TEST_F(StoreCheckTest, ALostDatabaseIsBegunAnew) {
  for (const char* end : {"", "-wal", "-shm"}) {
    std::filesystem::remove(test_ / "store/jobs.db" + end);
  }
  EXPECT_EQ(Check(false), 1);
  EXPECT_EQ(Check(true), 0);
  EXPECT_TRUE(absl::IsNotFound(Open()->Get("ann", "a").status()));
}

TEST_F(StoreCheckTest, WhatCanBeReadOfADamagedDatabaseIsSaved) {
  {
    auto store = Open();
    for (int i = 0; i < 200; ++i) {
      StoredJob stored{.owner = "ann", .client = "ann"};
      stored.job.set_job_id(absl::StrCat("j", i));
      stored.job.set_request_id(stored.job.job_id());
      stored.job.set_scan_id(scan_);
      stored.job.set_trace_id(std::string(300, 't'));
      ASSERT_TRUE(store->Insert(stored).ok());
    }
  }
  const std::string file = test_ / "store/jobs.db";
  const auto size = std::filesystem::file_size(file);
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(static_cast<std::streamoff>(size / 4096 / 2 * 4096));
    bytes.write(std::string(4096, 'x').data(), 4096);  // a page in the middle
  }
  EXPECT_TRUE(absl::IsDataLoss(JobStore::Open(test_ / "store").status()));
  EXPECT_EQ(Check(false), 1);
  EXPECT_EQ(Check(true), 0) << lines_;
  EXPECT_TRUE(std::filesystem::exists(file + ".old"));
  auto store = Open();
  int64_t before = 0;
  EXPECT_GT(store->List("ann", 1000, &before)->size(), 150u);
}

TEST_F(StoreCheckTest, ABackupOfAStoreInUseIsAStore) {
  {
    const auto in_use = Open();
    ASSERT_TRUE(BackUpStore(test_ / "store", test_ / "copy").ok());
    EXPECT_EQ(BackUpStore(test_ / "store", test_ / "copy").code(),
              absl::StatusCode::kAlreadyExists);
    ASSERT_TRUE(in_use->Remove("ann", "a").ok());
    EXPECT_EQ(BackUpStore(test_ / "none", test_ / "copy").code(), absl::StatusCode::kNotFound);
  }
  const auto left = CheckStore(test_ / "copy", false, [](const std::string&) {});
  EXPECT_EQ(left.value_or(-1), 0);
  auto copy = Open("copy");
  const auto a = copy->Get("ann", "a");
  ASSERT_TRUE(a.ok()) << a.status();
  EXPECT_TRUE(copy->blobs().Read(a->surface).ok());
  EXPECT_TRUE(copy->BytesOfScan("ann", scan_).ok());
  EXPECT_EQ(copy->Unfinished()->size(), 1u);
}

}  // namespace
}  // namespace rilievo
