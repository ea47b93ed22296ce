#include "server/conversion/call_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(CallError, JobErrorsNameTheFieldOrHideTheCause) {
  const CallError bad =
      ErrorOfJob(absl::InvalidArgumentError("12 distinct points; 20 needed"), "points", "job 0f3a");
  EXPECT_EQ(bad.reason, ErrorCause::kUnusableScan);
  EXPECT_EQ(bad.code(), absl::StatusCode::kInvalidArgument);
  ASSERT_EQ(bad.violations.size(), 1u);
  EXPECT_EQ(bad.violations[0].field, "points");
  EXPECT_EQ(bad.violations[0].description, "12 distinct points; 20 needed");

  EXPECT_EQ(bad.message, "points: 12 distinct points; 20 needed");

  // A stage that names the field itself does not make it be named twice.
  const CallError named =
      ErrorOfJob(absl::InvalidArgumentError("points: all 500 are identical"), "points", "job 0f3a");
  EXPECT_EQ(named.message, "points: all 500 are identical");
  EXPECT_EQ(named.violations[0].description, "all 500 are identical");

  const CallError wrong_road =
      ErrorOfJob(absl::FailedPreconditionError("not planar"), "points", "job 0f3a");
  EXPECT_EQ(wrong_road.reason, ErrorCause::kUnsuitableTopology);
  EXPECT_EQ(wrong_road.message, "not planar");

  for (const auto code :
       {absl::StatusCode::kInternal, absl::StatusCode::kUnknown, absl::StatusCode::kCancelled}) {
    const CallError hidden =
        ErrorOfJob(absl::Status(code, "/home/user/x.cc:12 broke"), "points", "job 0f3a");
    EXPECT_EQ(hidden.reason, ErrorCause::kServerDefect);
    EXPECT_THAT(hidden.message, HasSubstr(" at job 0f3a;"));
    EXPECT_THAT(hidden.message, Not(HasSubstr("/home")));
  }
  EXPECT_EQ(ErrorOfJob(absl::InternalError("broke"), "points", "").message,
            "the server failed; its operator finds the cause in the log");
}

TEST(CallError, AKilledWorkerAsksForARetryAndALateOneForLess) {
  const CallError killed = ErrorOfJob(absl::AbortedError("killed"), "points", "job 0f3a");
  EXPECT_EQ(killed.reason, ErrorCause::kWorkerKilled);
  EXPECT_TRUE(killed.retry_delay.has_value());
  const CallError late = ErrorOfJob(absl::DeadlineExceededError("too long"), "points", "job 0f3a");
  EXPECT_EQ(late.reason, ErrorCause::kJobTimeLimit);
  EXPECT_EQ(ErrorOfJob(absl::ResourceExhaustedError("too large"), "points", "job 0f3a").reason,
            ErrorCause::kJobTooLarge);
}

TEST(CallError, WhatTheMachineOrTheStoreLacksIsToldWithoutItsPath) {
  const CallError machine =
      ErrorOfJob(absl::UnavailableError("/usr/bin/x: no"), "points", "job 0f3a");
  EXPECT_EQ(machine.reason, ErrorCause::kWorkerUnavailable);
  EXPECT_TRUE(machine.retry_delay.has_value());
  const CallError scan =
      ErrorOfJob(absl::DataLossError("/store/blobs/x: damaged"), "points", "job 0f3a");
  EXPECT_EQ(scan.reason, ErrorCause::kScanDamaged);
  for (const CallError& error : {machine, scan}) EXPECT_THAT(error.message, Not(HasSubstr("/")));
}

TEST(CallError, AStatusCarriesTheReasonThatWasStated) {
  const absl::Status status =
      StatusOf(CallError(ErrorCause::kLimitExceeded, "too many").Limit(1000, 2000));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const auto stated = StatedError(status);
  ASSERT_TRUE(stated.has_value());
  EXPECT_EQ(stated->reason, ErrorCause::kLimitExceeded);
  EXPECT_EQ(stated->message, "too many");
  EXPECT_EQ(stated->metadata.at("limit"), "1000");
  EXPECT_EQ(stated->metadata.at("value"), "2000");
  EXPECT_EQ(ErrorOfJob(status, "points", "job 0f3a").reason, ErrorCause::kLimitExceeded);
  EXPECT_FALSE(StatedError(absl::NotFoundError("/var/x")).has_value());
}

TEST(CallError, ReasonsHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const ErrorCauseEntry& entry : ErrorCauses()) {
    EXPECT_THAT(entry.name, testing::MatchesRegex("[A-Z][A-Z_]*[A-Z]"));
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_NE(entry.code, absl::StatusCode::kOk);
  }
}

}  // namespace
}  // namespace rilievo
