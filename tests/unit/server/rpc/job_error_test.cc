#include "server/rpc/job_error.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "server/conversion/memory_estimate.h"

namespace rilievo {
namespace {

TEST(JobError, EveryReasonToStopHasItsStatus) {
  const ServerOptions options;
  EXPECT_EQ(StopError(StopReason::kJobTime, options).reason, ErrorCause::kJobTimeLimit);
  EXPECT_EQ(StopError(StopReason::kIdle, options).reason, ErrorCause::kIdleLimit);
  EXPECT_EQ(StopError(StopReason::kUploadTime, options).reason, ErrorCause::kUploadTimeLimit);
  EXPECT_EQ(StopError(StopReason::kShutdown, options).reason, ErrorCause::kShuttingDown);
  EXPECT_EQ(StopError(StopReason::kClient, options).reason, ErrorCause::kClientCancelled);
  EXPECT_EQ(StopError(StopReason::kJobTime, options).metadata.at("limit"), "600");
  EXPECT_TRUE(ShutdownError().retry_delay.has_value());
}

TEST(JobError, AJobThatNeedsMoreThanThereIsSaysHowMuch) {
  JobRequest job;
  job.size.points = 100'000;
  const int64_t enough = EstimateMemory(job);
  ServerOptions options;
  options.memory_budget = enough;
  EXPECT_FALSE(CheckMemory(job, options).has_value());
  job.size.points = 200'000;
  const auto error = CheckMemory(job, options);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->reason, ErrorCause::kMemoryLimit);
  EXPECT_EQ(error->metadata.at("limit"), absl::StrCat(enough));
  EXPECT_EQ(error->metadata.at("value"), absl::StrCat(EstimateMemory(job)));
  EXPECT_NE(error->message.find(absl::StrCat(enough / 1'000'000, " MB")), std::string::npos);
}

TEST(JobError, AMeshOfTheClientsIsNamed) {
  JobRequest job;
  const absl::Status status = absl::InvalidArgumentError("it is not a surface");
  EXPECT_EQ(FieldAtFault(Stage::kNormals, job, status), "points");
  EXPECT_EQ(FieldAtFault(Stage::kControlMesh, job, status), "header.options.control");
  EXPECT_EQ(FieldAtFault(Stage::kDomainFit, job, status), "points");
  job.options.control.user_mesh.emplace();
  EXPECT_EQ(FieldAtFault(Stage::kControlMesh, job, status), "header.options.control.control_mesh");
  EXPECT_EQ(FieldAtFault(Stage::kDomainFit, job, status), "header.options.control.control_mesh");
}

TEST(JobError, TrianglesAtFaultAreNamed) {
  JobRequest job;
  job.size.triangles = 8;
  const auto field = [&job](const char* text) {
    return FieldAtFault(Stage::kCheck, job, absl::InvalidArgumentError(text));
  };
  EXPECT_EQ(field("triangles: triangle 3 names vertex 9 of 4"), "triangles");
  EXPECT_EQ(field("points: all of them are the same"), "points");
}

}  // namespace
}  // namespace rilievo
