#include "server/rpc/progress_queue.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

using std::chrono::milliseconds;

const ProgressQueue::Clock::time_point kStart = ProgressQueue::Clock::now();

TEST(ProgressQueue, PassesStagesWithTheirTimes) {
  ProgressQueue queue;
  queue.Queued(kStart);
  EXPECT_EQ(queue.Pop()->stage(), v1::STAGE_QUEUED);
  queue.Report({Stage::kCheck, 0}, kStart + milliseconds(500));
  auto event = queue.Pop();
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->stage(), v1::STAGE_CHECK);
  EXPECT_EQ(event->stage_seconds(), 0);
  EXPECT_DOUBLE_EQ(event->total_seconds(), 0.5);
  queue.Report({Stage::kCheck, 1}, kStart + milliseconds(750));
  event = queue.Pop();
  EXPECT_EQ(event->fraction(), 1);
  EXPECT_DOUBLE_EQ(event->stage_seconds(), 0.25);
  EXPECT_DOUBLE_EQ(event->total_seconds(), 0.75);
  EXPECT_FALSE(queue.Pop().has_value());
}

TEST(ProgressQueue, ThrottlesWithinAStageButNeverItsEnds) {
  ProgressQueue queue;
  int taken = 0;
  for (int ms = 0; ms <= 1000; ++ms) {
    queue.Report({Stage::kDomainFit, ms / 1000.0}, kStart + milliseconds(ms));
    double fraction = -1;
    while (auto event = queue.Pop()) {
      ++taken;
      fraction = event->fraction();
    }
    if (ms == 0 || ms == 1000) {
      EXPECT_EQ(fraction, ms / 1000);
    }
  }
  EXPECT_EQ(taken, 11);  // at 0, 100, ..., 1000 ms
}

TEST(ProgressQueue, HoldsOneEventAStageForASlowReader) {
  ProgressQueue queue;
  queue.Queued(kStart);
  for (int step = 0; step < 1000; ++step) {
    for (int stage = 0; stage < kStageCount; ++stage) {
      queue.Report({static_cast<Stage>(stage), 1}, kStart + milliseconds(step));
    }
  }
  int held = 0;
  int last = -1;
  while (auto event = queue.Pop()) {
    ++held;
    EXPECT_GT(static_cast<int>(event->stage()), last);
    last = event->stage();
  }
  EXPECT_EQ(held, kStageCount + 1);
  EXPECT_EQ(queue.stage(), Stage::kEncode);
}

}  // namespace
}  // namespace rilievo
