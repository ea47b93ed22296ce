#include "client/library/retry.h"

#include <gtest/gtest.h>

#include <thread>

namespace rilievo {
namespace {

using std::chrono::milliseconds;

constexpr RetryOptions kFast{
    .attempts = 4, .first_pause = milliseconds(10), .longest_pause = milliseconds(40)};

TEST(Retry, GivesUpAfterItsAttemptsAndBeginsAnewWithProgress) {
  Retry retry(kFast, std::nullopt, {});
  const absl::Status away = absl::UnavailableError("away");
  for (int round = 0; round < 2; ++round) {
    EXPECT_TRUE(retry.AfterFailure(away));
    EXPECT_TRUE(retry.AfterFailure(away));
    EXPECT_TRUE(retry.AfterFailure(away));
    EXPECT_FALSE(retry.AfterFailure(away));
    retry.Progress();
  }
}

TEST(Retry, OnlyWhatMayPassIsTriedAgain) {
  Retry retry(kFast, std::nullopt, {});
  EXPECT_FALSE(retry.AfterFailure(absl::InvalidArgumentError("wrong")));
  EXPECT_FALSE(retry.AfterFailure(absl::ResourceExhaustedError("no time to retry is named")));
  EXPECT_TRUE(retry.AfterFailure(absl::CancelledError("by a server that ends")));
  EXPECT_TRUE(
      retry.AfterFailure(absl::ResourceExhaustedError("Received RST_STREAM with error code 11")));
}

TEST(Retry, PausesGrowWithinTheirLimit) {
  RetryOptions options = kFast;
  options.attempts = 6;
  Retry retry(options, std::nullopt, {});
  const auto start = Retry::Clock::now();
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(retry.AfterFailure(absl::UnavailableError("")));
  const auto waited = Retry::Clock::now() - start;
  EXPECT_GE(waited, milliseconds(5 + 10 + 20 + 20 + 20));
  EXPECT_LT(waited, std::chrono::seconds(5));
}

TEST(Retry, NeverWaitsBeyondTheDeadlineOrAfterAStop) {
  RetryOptions slow = kFast;
  slow.first_pause = slow.longest_pause = std::chrono::hours(1);
  Retry late(slow, Retry::Clock::now() + std::chrono::seconds(1), {});
  EXPECT_FALSE(late.AfterFailure(absl::UnavailableError("")));
  std::stop_source stop;
  Retry stopped(slow, std::nullopt, stop.get_token());
  const std::jthread stopper([&] {
    std::this_thread::sleep_for(milliseconds(50));
    stop.request_stop();
  });
  EXPECT_FALSE(stopped.AfterFailure(absl::UnavailableError("")));
  EXPECT_FALSE(stopped.AfterFailure(absl::CancelledError("")));
}

}  // namespace
}  // namespace rilievo
