#include "server/jobs/store_keeper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

TEST(StoreKeeper, CleansAtOnceAndCallsEachSecond) {
  const TestFolder test;
  std::atomic<int64_t> now{1'000'000};
  StoreSettings settings;
  settings.retention.age_ms = 1000;
  settings.clock = {.wall_ms = [] { return int64_t{1'700'000'000'000}; },
                    .steady_ms = [&] { return now.load(); }};
  auto store = *JobStore::Open(test / "store", settings);
  const std::string scan = *store->blobs().Put({std::vector<uint8_t>(400, 1)});
  ASSERT_TRUE(store->AddScan("", scan).ok());
  now += 2000;
  std::atomic<int> calls{0};
  const StoreKeeper keeper(store.get(), [&] { ++calls; });
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while ((calls < 2 || store->blobs().Read(scan).ok()) && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_GE(calls, 2);
  EXPECT_FALSE(store->blobs().Read(scan).ok());
}

}  // namespace
}  // namespace rilievo
