#include "server/rpc/job_error.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(JobError, EveryReasonToStopHasItsStatus) {
  const ServerOptions options;
  EXPECT_EQ(StopError(StopReason::kJobTime, options).reason, "JOB_TIME_LIMIT");
  EXPECT_EQ(StopError(StopReason::kIdle, options).reason, "IDLE_LIMIT");
  EXPECT_EQ(StopError(StopReason::kUploadTime, options).reason, "UPLOAD_TIME_LIMIT");
  EXPECT_EQ(StopError(StopReason::kShutdown, options).code, absl::StatusCode::kUnavailable);
  EXPECT_EQ(StopError(StopReason::kClient, options).code, absl::StatusCode::kCancelled);
  EXPECT_TRUE(ShutdownError().retry_delay.has_value());
}

TEST(JobError, AJobThatNeedsMoreThanThereIsSaysHowMuch) {
  ServerOptions options;
  options.memory_budget = 100'000'000;
  JobRequest job;
  job.point_count = 100'000;
  EXPECT_FALSE(CheckMemory(job, options).has_value());
  job.point_count = 200'000;
  const auto error = CheckMemory(job, options);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code, absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(error->reason, "MEMORY_LIMIT");
  EXPECT_NE(error->message.find("100 MB"), std::string::npos);
}

TEST(JobError, AMeshOfTheClientsIsNamed) {
  JobRequest job;
  EXPECT_EQ(FieldAtFault(Stage::kNormals, job), "points");
  EXPECT_EQ(FieldAtFault(Stage::kControlMesh, job), "header.options.control");
  EXPECT_EQ(FieldAtFault(Stage::kDomainFit, job), "points");
  job.options.control.user_mesh.emplace();
  EXPECT_EQ(FieldAtFault(Stage::kControlMesh, job), "header.options.control.control_mesh");
  EXPECT_EQ(FieldAtFault(Stage::kDomainFit, job), "header.options.control.control_mesh");
}

}  // namespace
}  // namespace rilievo
