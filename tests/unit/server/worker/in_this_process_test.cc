#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <utility>

#include "server/worker/job_work.h"

namespace rilievo {
namespace {

JobRequest Request() {
  JobRequest job;
  job.size.points = 2;
  job.size.layout = {CoordinateType::kFloat64};
  job.options.measure = false;
  return job;
}

ScanBytes Points() { return ScanBytes({std::string(24, '\0'), std::string(24, '\0')}); }

TEST(InThisProcess, HandsOnPointsOptionsAndResult) {
  const JobWork work = InThisProcess(
      [](const PointCloud& scan, const ReconstructOptions& options, const RunContext& context) {
        EXPECT_EQ(scan.points.cols(), 2);
        EXPECT_FALSE(options.measure);
        EXPECT_EQ(context.seed, 7u);
        Reconstruction result;
        result.encoded.chunks = {{1, 2, 3}};
        result.report.topology = "planar";
        return absl::StatusOr<Reconstruction>(std::move(result));
      });
  RunContext context;
  context.seed = 7;
  const auto result = work(Request(), Points(), context);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->report.road(), "planar");
  EXPECT_FALSE(result->report.has_error());
  EXPECT_EQ(result->encoded.chunks.size(), 1u);
}

TEST(InThisProcess, WhatIsThrownBecomesAStatus) {
  const auto run = [](const std::function<void()>& action) {
    return InThisProcess([&](const auto&, const auto&, const auto&) {
             action();
             return absl::StatusOr<Reconstruction>(absl::CancelledError());
           })(Request(), Points(), {})
        .status()
        .code();
  };
  EXPECT_EQ(run([] { throw std::bad_alloc(); }), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(run([] { throw std::runtime_error("x"); }), absl::StatusCode::kInternal);
  EXPECT_EQ(run([] {}), absl::StatusCode::kCancelled);
}

TEST(InThisProcess, AScratchFolderThatIsGoneIsTheMachinesTrouble) {
  JobRequest job = Request();
  job.parts = {4096, ScratchFolder("/nonexistent")};
  const absl::Status status = InServerProcess({})(job, Points(), {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("/nonexistent"));
}

}  // namespace
}  // namespace rilievo
