#include "core/control/implicit/poisson_solver.h"

#include <gtest/gtest.h>

#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

ActiveSamples Everyone(const OrientedCloud& cloud) {
  ActiveSamples samples{.points = {}, .spacing = cloud.spacing};
  for (int i = 0; i < cloud.points.cols(); ++i) samples.points.push_back(i);
  return samples;
}

// On a plane the solution steps from one value below to its negative above, and is 0 on the plane.
TEST(PoissonSolverTest, APlaneOfPointsGivesAStepAcrossIt) {
  constexpr int kSide = 40;
  OrientedCloud cloud;
  cloud.points.resize(3, kSide * kSide);
  cloud.normals.resize(3, kSide * kSide);
  ActiveSamples samples;
  for (int i = 0; i < kSide * kSide; ++i) {
    cloud.points.col(i) << (i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide, 0.513;
    cloud.normals.col(i) = Eigen::Vector3d::UnitZ();
    samples.points.push_back(i);
  }
  const float spacing = static_cast<float>(std::sqrt(4 / std::numbers::pi) / kSide);
  samples.spacing.assign(samples.points.size(), spacing);
  SparseGrid grid;
  grid.AddBox({0, 0, 0}, {20, 20, 20});
  grid.Seal();
  std::vector<float> values(grid.size(), 0.0f);
  const std::vector<int8_t> sides(samples.points.size(), 1);
  const ScreenedPoisson system{.cloud = cloud,
                               .sides = sides,
                               .samples = samples,
                               .grid = grid,
                               .origin = Eigen::Vector3d::Zero(),
                               .cell = 0.05,
                               .screening = 2,
                               .border_free = true,
                               .iterations = 200};
  ASSERT_TRUE(SolvePoisson(system, RunContext{}, &values).ok());
  for (int x = 5; x <= 15; ++x) {
    const float below = values[grid.Find({x, 10, 6})];
    const float above = values[grid.Find({x, 10, 15})];
    EXPECT_NEAR(above - below, 1.0, 0.1);  // the border of the patch leaks a little
    EXPECT_LT(values[grid.Find({x, 10, 10})], 0);
    EXPECT_GT(values[grid.Find({x, 10, 11})], 0);
  }
}

TEST(PoissonSolverTest, TheNumberOfThreadsDoesNotChangeABit) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 5000, kTorusArea);
  const ActiveSamples samples = Everyone(shape.cloud);
  SparseGrid grid;
  grid.AddBox(Eigen::Vector3i::Constant(-35), Eigen::Vector3i::Constant(35));
  grid.Seal();
  const std::vector<int8_t> sides(samples.points.size(), 1);
  const ScreenedPoisson system{.cloud = shape.cloud,
                               .sides = sides,
                               .samples = samples,
                               .grid = grid,
                               .origin = Eigen::Vector3d::Zero(),
                               .cell = 0.02,
                               .screening = 2,
                               .border_free = true,
                               .iterations = 12};
  std::vector<float> one(grid.size(), 0.0f), two(grid.size(), 0.0f);
  RunContext context;
  context.threads = 1;
  ASSERT_TRUE(SolvePoisson(system, context, &one).ok());
  context.threads = 2;
  ASSERT_TRUE(SolvePoisson(system, context, &two).ok());
  EXPECT_EQ(one, two);
}

TEST(PoissonSolverTest, StopsWhenAsked) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 2000, kTorusArea);
  const ActiveSamples samples = Everyone(shape.cloud);
  SparseGrid grid;
  grid.AddBox(Eigen::Vector3i::Constant(-5), Eigen::Vector3i::Constant(5));
  grid.Seal();
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  std::vector<float> values(grid.size(), 0.0f);
  const std::vector<int8_t> sides(samples.points.size(), 1);
  const ScreenedPoisson system{shape.cloud, sides, samples, grid, Eigen::Vector3d::Zero(),
                               0.1,         2,     true,    9};
  EXPECT_EQ(SolvePoisson(system, context, &values).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
