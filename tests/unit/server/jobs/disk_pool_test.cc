#include "server/jobs/disk_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <set>

namespace rilievo {
namespace {

TEST(DiskPool, DoesEverythingBeforeItEnds) {
  std::atomic<int> done{0};
  {
    DiskPool pool(2);
    for (int i = 0; i < 1000; ++i) pool.Post([&] { ++done; });
  }
  EXPECT_EQ(done, 1000);
}

TEST(DiskPool, ATaskThatWaitsDoesNotHoldUpAll) {
  std::promise<void> release;
  DiskPool pool(2);
  pool.Post([waiting = release.get_future().share()] { waiting.wait(); });
  std::promise<void> passed;
  pool.Post([&] { passed.set_value(); });
  EXPECT_EQ(passed.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
  release.set_value();
}

TEST(DiskPool, TasksMayPostTasks) {
  std::promise<void> done;
  DiskPool pool(1);
  pool.Post([&] { pool.Post([&] { done.set_value(); }); });
  EXPECT_EQ(done.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
}

}  // namespace
}  // namespace rilievo
