#include "server/conversion/call_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(CallError, JobErrorsNameTheFieldOrHideTheCause) {
  const CallError bad =
      ErrorOfJob(absl::InvalidArgumentError("12 distinct points; 20 needed"), "points", 7);
  EXPECT_EQ(bad.code, absl::StatusCode::kInvalidArgument);
  ASSERT_EQ(bad.violations.size(), 1u);
  EXPECT_EQ(bad.violations[0].field, "points");
  EXPECT_EQ(bad.violations[0].description, "12 distinct points; 20 needed");

  const CallError wrong_road = ErrorOfJob(absl::FailedPreconditionError("not planar"), "points", 7);
  EXPECT_EQ(wrong_road.code, absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(wrong_road.message, "not planar");

  for (const auto code : {absl::StatusCode::kInternal, absl::StatusCode::kUnknown,
                          absl::StatusCode::kCancelled, absl::StatusCode::kDataLoss}) {
    const CallError hidden =
        ErrorOfJob(absl::Status(code, "/home/user/x.cc:12 broke"), "points", 7);
    EXPECT_EQ(hidden.code, absl::StatusCode::kInternal);
    EXPECT_THAT(hidden.message, HasSubstr("job 7"));
    EXPECT_THAT(hidden.message, Not(HasSubstr("/home")));
  }
}

TEST(CallError, AKilledWorkerAsksForARetryAndALateOneForLess) {
  const CallError killed = ErrorOfJob(absl::AbortedError("killed"), "points", 7);
  EXPECT_EQ(killed.code, absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(killed.reason, "WORKER_KILLED");
  EXPECT_TRUE(killed.retry_delay.has_value());
  const CallError late = ErrorOfJob(absl::DeadlineExceededError("too long"), "points", 7);
  EXPECT_EQ(late.code, absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(late.reason, "JOB_TIME_LIMIT");
}

}  // namespace
}  // namespace rilievo
