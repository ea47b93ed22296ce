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
  EXPECT_FALSE(FitIntoMemory(options, &job).has_value());
  job.size.points = 200'000;
  const auto error = FitIntoMemory(options, &job);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->reason, ErrorCause::kMemoryLimit);
  EXPECT_EQ(error->metadata.at("limit"), absl::StrCat(enough));
  EXPECT_EQ(error->metadata.at("value"), absl::StrCat(EstimateMemory(job)));
  EXPECT_NE(error->message.find(absl::StrCat(enough / 1'000'000, " MB")), std::string::npos);
  EXPECT_NE(error->message.find("--scratch"), std::string::npos);
}

TEST(JobError, WhatDoesNotFitIsMadeByPartsWhereItCanBe) {
  ServerOptions options;
  options.memory_budget = 100'000'000;
  options.scratch = testing::TempDir();
  JobRequest job;
  job.size.points = 1'000'000;
  const auto refused = FitIntoMemory(options, &job);
  ASSERT_TRUE(refused.has_value());
  const int64_t by_parts = EstimateMemoryOfParts(PartSizes{}, 1'000'000);
  EXPECT_GT(by_parts, options.memory_budget);
  EXPECT_NE(
      refused->message.find(absl::StrCat("by parts it would need ", by_parts / 1'000'000, " MB")),
      std::string::npos);
  options.part_points = 4096;
  EXPECT_FALSE(FitIntoMemory(options, &job).has_value());
  ASSERT_TRUE(job.parts.has_value());
  EXPECT_EQ(job.parts->points, 4096);
  EXPECT_EQ(EstimateMemory(job), EstimateMemoryOfParts(PartSizes::Of(4096), 1'000'000));
  EXPECT_FALSE(CheckScratch(job).has_value());
  job.size.points = int64_t{1} << 50;
  EXPECT_EQ(CheckScratch(job)->reason, ErrorCause::kStoreFull);

  // Though the server has more, the process of the job may not.
  options.memory_budget = 1'000'000'000'000;
  options.max_job_memory = 100'000'000;
  JobRequest mesh;
  mesh.size.points = mesh.size.triangles = 1'000'000;
  const auto error = FitIntoMemory(options, &mesh);
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("a mesh is not made by parts"), std::string::npos);
  JobRequest sights;
  sights.size.points = 1'000'000;
  sights.options.scan.sights.normals = SightRule::kUse;
  EXPECT_NE(FitIntoMemory(options, &sights)->message.find("do not use normals"), std::string::npos);
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
