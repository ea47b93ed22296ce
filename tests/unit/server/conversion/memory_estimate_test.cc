#include "server/conversion/memory_estimate.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(MemoryEstimate, IsThatOfTheMeasuredScans) {
  JobRequest job;
  // Measured at the peak of a worker. A little more is right, less would not be.
  for (const auto& [points, measured] : {std::pair(20'000, 38.5e6), std::pair(100'000, 86e6),
                                         std::pair(200'000, 130e6), std::pair(1'000'000, 459e6)}) {
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
  EXPECT_EQ(EstimateMemory(job) - two, 100 * (6400 - 1600));
  job.options.max_level = 8;
  job.options.control.target_faces = 200'000;
  job.options.max_surface_faces = 1'000'000;
  EXPECT_LT(EstimateMemory(job), 150'000'000) << "never more faces than the server builds";
}

}  // namespace
}  // namespace rilievo
