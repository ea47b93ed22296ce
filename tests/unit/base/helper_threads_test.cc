#include "core/base/helper_threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <latch>
#include <memory>
#include <set>
#include <thread>

#include "core/base/parallel_for.h"

namespace rilievo {
namespace {

TEST(HelperThreadsTest, EachOfferIsTakenByAThreadOfItsOwn) {
  const auto all_there = std::make_shared<std::latch>(4);
  for (int i = 0; i < 3; ++i) OfferWork(1, [] {});
  OfferWork(3, [all_there] { all_there->arrive_and_wait(); });
  all_there->arrive_and_wait();
}

TEST(HelperThreadsTest, NoHelpersIsNoCall) {
  std::atomic<int> calls{0};
  OfferWork(0, [&] { ++calls; });
  OfferWork(-1, [&] { ++calls; });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(calls, 0);
}

// All helpers are held up elsewhere: the caller does the work and does not wait for them.
TEST(HelperThreadsTest, WorkThatNobodyHelpsWithIsDone) {
  const auto held = std::make_shared<std::latch>(1);
  OfferWork(256, [held] { held->wait(); });
  RunContext context;
  context.threads = 8;
  std::set<std::thread::id> workers;
  EXPECT_TRUE(ParallelFor(1000, 1, context, [&](int64_t, int64_t) {
                workers.insert(std::this_thread::get_id());
              }).ok());
  EXPECT_EQ(workers, std::set{std::this_thread::get_id()});
  held->count_down();
}

// A body that runs blocks of its own, on every thread at once.
TEST(HelperThreadsTest, CallsMayBeNested) {
  RunContext context;
  context.threads = 4;
  std::atomic<int> calls{0};
  EXPECT_TRUE(ParallelFor(50, 1, context, [&](int64_t, int64_t) {
                EXPECT_TRUE(ParallelFor(20, 1, context, [&](int64_t, int64_t) { ++calls; }).ok());
              }).ok());
  EXPECT_EQ(calls, 1000);
}

}  // namespace
}  // namespace rilievo
