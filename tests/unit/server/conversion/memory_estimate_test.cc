#include "server/conversion/memory_estimate.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(MemoryEstimate, IsThatOfTheMeasuredScans) {
  JobRequest job;
  // Measured at the peak: 60, 157 and 506 MB. A little more is right, less would not be.
  for (const auto& [points, measured] :
       {std::pair(20'000, 60e6), std::pair(100'000, 157e6), std::pair(400'000, 506e6)}) {
    job.point_count = points;
    const auto estimate = static_cast<double>(EstimateMemory(job));
    EXPECT_GT(estimate, measured);
    EXPECT_LT(estimate, 1.25 * measured);
  }
}

TEST(MemoryEstimate, ALevelMultipliesTheFaces) {
  JobRequest job;
  job.point_count = 1000;
  job.options.control.target_faces = 100;
  job.options.max_level = 2;
  const int64_t two = EstimateMemory(job);
  job.options.max_level = 3;
  EXPECT_EQ(EstimateMemory(job) - two, 310 * (6400 - 1600));
  job.options.max_level = 8;
  job.options.control.target_faces = 200'000;
  job.options.max_surface_faces = 1'000'000;
  EXPECT_LT(EstimateMemory(job), 400'000'000) << "never more faces than the server builds";
}

}  // namespace
}  // namespace rilievo
