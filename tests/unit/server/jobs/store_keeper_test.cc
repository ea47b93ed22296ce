#include "server/jobs/store_keeper.h"

#include <gtest/gtest.h>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

TEST(StoreKeeper, MakesRoomByRemovingFinishedJobs) {
  const TestFolder test;
  auto store = *JobStore::Open(test / "store");
  StoredJob stored;
  stored.job.set_job_id("a");
  stored.job.set_request_id("r");
  stored.job.set_scan_id(*store->blobs().Put({std::vector<uint8_t>(400, 1)}));
  ASSERT_TRUE(store->AddScan("", stored.job.scan_id()).ok());
  ASSERT_TRUE(store->Insert(stored).ok());
  stored.job.set_state(v1::JOB_STATE_SUCCEEDED);
  stored.job.mutable_end_time()->set_seconds(std::time(nullptr));
  ASSERT_TRUE(store->Finish(stored, {std::vector<uint8_t>(500, 2)}).ok());

  StoreKeeper keeper(store.get(), {.age_ms = 3'600'000, .bytes = 1000});
  EXPECT_FALSE(keeper.MakeRoomFor(1001)) << "more than there ever is";
  EXPECT_TRUE(store->Get("", "a").ok()) << "nothing is removed for what cannot fit";
  EXPECT_TRUE(keeper.MakeRoomFor(100));
  EXPECT_TRUE(store->Get("", "a").ok());
  EXPECT_TRUE(keeper.MakeRoomFor(101));
  EXPECT_FALSE(store->Get("", "a").ok());
}

TEST(StoreKeeper, WhatWasGrantedCounts) {
  const TestFolder test;
  auto store = *JobStore::Open(test / "store");
  ASSERT_TRUE(store->blobs().Put({std::vector<uint8_t>(400, 1)}).ok());  // too young to be removed
  StoreKeeper keeper(store.get(), {.age_ms = 3'600'000, .bytes = 1000});
  EXPECT_TRUE(keeper.MakeRoomFor(500));
  // The first 500 never came, as the cleaning that this one causes finds.
  EXPECT_TRUE(keeper.MakeRoomFor(600));
  EXPECT_FALSE(keeper.MakeRoomFor(601));
}

}  // namespace
}  // namespace rilievo
