#include "core/base/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <stop_token>
#include <vector>

namespace rilievo {
namespace {

TEST(ParallelForTest, CoversEachIndexOnce) {
  for (const int threads : {1, 2, 5}) {
    for (const int64_t count : {1, 7, 64, 1000}) {
      RunContext context;
      context.threads = threads;
      std::vector<std::atomic<int>> visits(static_cast<size_t>(count));
      ASSERT_TRUE(ParallelFor(count, 16, context, [&](int64_t begin, int64_t end) {
                    EXPECT_LE(end - begin, 16);
                    for (int64_t i = begin; i < end; ++i) ++visits[i];
                  }).ok());
      for (const auto& visit : visits) EXPECT_EQ(visit, 1);
    }
  }
}

TEST(ParallelForTest, NothingToDoIsNoCall) {
  int calls = 0;
  const auto body = [&](int64_t, int64_t) { ++calls; };
  EXPECT_TRUE(ParallelFor(0, 16, RunContext{}, body).ok());
  EXPECT_TRUE(ParallelFor(-3, 16, RunContext{}, body).ok());
  EXPECT_EQ(calls, 0);
}

TEST(ParallelForTest, BlockBelowOneIsTakenAsOne) {
  std::atomic<int> calls{0};
  EXPECT_TRUE(ParallelFor(5, 0, RunContext{}, [&](int64_t, int64_t) { ++calls; }).ok());
  EXPECT_EQ(calls, 5);
}

TEST(ParallelForTest, StoppedBeforeDoesNothing) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  std::atomic<int> calls{0};
  const auto body = [&](int64_t, int64_t) { ++calls; };
  EXPECT_EQ(ParallelFor(100, 1, context, body).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(ParallelFor(0, 1, context, body).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(calls, 0);
}

TEST(ParallelForTest, WhatABlockThrowsReachesTheCaller) {
  for (const int threads : {1, 4}) {
    RunContext context;
    context.threads = threads;
    std::atomic<int> calls{0};
    const auto body = [&](int64_t begin, int64_t) {
      ++calls;
      if (begin == 7) throw std::bad_alloc();
    };
    EXPECT_THROW(ParallelFor(100000, 1, context, body).IgnoreError(), std::bad_alloc) << threads;
    EXPECT_LT(calls, 100000);
  }
}

TEST(ParallelForTest, StopSkipsTheBlocksThatAreLeft) {
  std::stop_source source;
  RunContext context;
  context.stop = source.get_token();
  context.threads = 2;
  std::atomic<int> calls{0};
  const absl::Status status = ParallelFor(10000, 1, context, [&](int64_t, int64_t) {
    if (++calls == 10) source.request_stop();
  });
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_LT(calls, 20);  // those under way when it was asked
}

}  // namespace
}  // namespace rilievo
