#include "core/base/run_concurrently.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>

#include "core/base/parallel_for.h"

namespace rilievo {
namespace {

TEST(RunConcurrentlyTest, BothRunAndTheFirstIsTheCallers) {
  for (const int threads : {1, 2, 4}) {
    RunContext context;
    context.threads = threads;
    const std::thread::id caller = std::this_thread::get_id();
    for (int round = 0; round < 200; ++round) {
      int first = 0, second = 0;
      const absl::Status status = RunConcurrently(
          context,
          [&] {
            EXPECT_EQ(std::this_thread::get_id(), caller);
            first = round;
            return absl::OkStatus();
          },
          [&] {
            second = round;
            return absl::OkStatus();
          });
      ASSERT_TRUE(status.ok());
      ASSERT_EQ(first, round);
      ASSERT_EQ(second, round);
    }
  }
}

TEST(RunConcurrentlyTest, TheSecondRunsMeanwhile) {
  RunContext context;
  context.threads = 2;
  std::promise<void> came;
  const absl::Status status = RunConcurrently(
      context,
      [&] {
        EXPECT_EQ(came.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
        return absl::OkStatus();
      },
      [&] {
        came.set_value();
        return absl::OkStatus();
      });
  EXPECT_TRUE(status.ok());
}

TEST(RunConcurrentlyTest, WhoIsDoneFirstHelpsTheSecond) {
  RunContext context;
  context.threads = 2;
  RunContext many;
  many.threads = 1000;  // more offers than threads that wait
  const std::thread::id caller = std::this_thread::get_id();
  std::promise<void> came;
  std::atomic<bool> caller_helped = false;
  const absl::Status status = RunConcurrently(
      context,
      [&] {
        EXPECT_EQ(came.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
        return absl::OkStatus();
      },
      [&] {
        came.set_value();
        return ParallelFor(30000, 1, many, [&](int64_t, int64_t) {
          if (std::this_thread::get_id() == caller) caller_helped = true;
          if (!caller_helped) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        });
      });
  EXPECT_TRUE(status.ok());
  EXPECT_TRUE(caller_helped);
}

TEST(RunConcurrentlyTest, ErrorsAndExceptionsOfEither) {
  RunContext context;
  context.threads = 2;
  const auto fine = [] { return absl::OkStatus(); };
  const auto stopped = [] { return absl::CancelledError("stopped"); };
  const auto faulty = [] { return absl::InternalError("faulty"); };
  const auto throws = []() -> absl::Status { throw std::runtime_error("thrown"); };
  EXPECT_EQ(RunConcurrently(context, stopped, fine), stopped());
  EXPECT_EQ(RunConcurrently(context, fine, faulty), faulty());
  EXPECT_EQ(RunConcurrently(context, stopped, faulty), stopped());
  EXPECT_THROW(RunConcurrently(context, throws, fine).IgnoreError(), std::runtime_error);
  EXPECT_THROW(RunConcurrently(context, fine, throws).IgnoreError(), std::runtime_error);
}

}  // namespace
}  // namespace rilievo
