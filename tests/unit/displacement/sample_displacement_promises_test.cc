// What sampling promises whatever the shape: order, threads, bounds, progress, stops, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <thread>

#include "core/displacement/sample_displacement.h"
#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr double kSphereRadius = 0.3;

TEST(SampleDisplacementTest, TheOrderOfThePointsDoesNotMatter) {
  const Points points = SpherePoints(kSphereRadius, 6000);
  std::vector<int> order(points.at.size());
  std::iota(order.begin(), order.end(), 0);
  Random random(7);
  for (size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
  Points shuffled;
  for (int i : order) shuffled.Add(points.at[i], points.normal[i]);
  const Domain domain = MakeDomain(Octahedron(0.295, 2), 3);
  const DisplacementField a = Sample(MakeScan(points.Positions(), points.Normals(), 0), domain);
  const DisplacementField b = Sample(MakeScan(shuffled.Positions(), shuffled.Normals(), 0), domain);
  EXPECT_EQ(a.source, b.source);
  EXPECT_LT(Compare(a, [&](int v) { return b.heights[v]; }).max, 2e-5);
}

TEST(SampleDisplacementTest, SameBytesForAnyNumberOfThreads) {
  Random random(8);
  Points points = SpherePoints(kSphereRadius, 8000);
  for (Eigen::Vector3d& p : points.at) p += 0.002 * Gauss(&random) * p.normalized();
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0.002);
  const Domain domain = MakeDomain(Octahedron(0.295, 2), 4);
  const DisplacementField one = Sample(scan, domain, DisplacementOptions(), 1);
  const DisplacementField two = Sample(scan, domain, DisplacementOptions(), 2);
  const DisplacementField five = Sample(scan, domain, DisplacementOptions(), 5);
  EXPECT_EQ(one.heights, two.heights);
  EXPECT_EQ(one.source, two.source);
  EXPECT_EQ(one.heights, five.heights);
}

TEST(SampleDisplacementTest, HeightsStayFiniteAndBoundedOnAnyCloud) {
  Random random(9);
  Points points;
  for (int i = 0; i < 5000; ++i) {
    const auto anywhere = [&] {
      return Eigen::Vector3d(Uniform(&random, -0.3, 0.3), Uniform(&random, -0.3, 0.3),
                             Uniform(&random, -0.3, 0.3));
    };
    const Eigen::Vector3d at = anywhere();
    points.Add(at, anywhere());
  }
  for (const double noise : {0.0, 0.02}) {
    const Scan scan = MakeScan(points.Positions(), points.Normals(), noise);
    const Domain domain = MakeDomain(Octahedron(0.25, 2), 3);
    DisplacementOptions options;
    options.min_normal_agreement = -1;
    const DisplacementField field = Sample(scan, domain, options);
    for (float height : field.heights) {
      ASSERT_TRUE(std::isfinite(height));
      ASSERT_LE(std::abs(height), options.max_height);
    }
  }
}

TEST(SampleDisplacementTest, ReportsProgressFromTheCallingThreadAndEndsAtOne) {
  const Scan scan = SphereScan(kSphereRadius, 3000);
  const Domain domain = MakeDomain(Octahedron(0.295, 2), 3);
  RunContext context = Threads(2);
  std::vector<double> fractions;
  const auto caller = std::this_thread::get_id();
  context.progress = [&](const Progress& progress) {
    EXPECT_EQ(progress.stage, Stage::kDisplacement);
    EXPECT_EQ(std::this_thread::get_id(), caller);
    fractions.push_back(progress.fraction);
  };
  ASSERT_TRUE(SampleDisplacement(scan.cloud, domain.refinement, domain.rings, domain.limit,
                                 DisplacementOptions(), context)
                  .ok());
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  ASSERT_GE(fractions.size(), 3u);
  EXPECT_EQ(fractions.front(), 0.0);
  EXPECT_EQ(fractions.back(), 1.0);
}

TEST(SampleDisplacementTest, StopsWhenAsked) {
  const Scan scan = SphereScan(kSphereRadius, 3000);
  const Domain domain = MakeDomain(Octahedron(0.295, 2), 3);
  std::stop_source stop;
  RunContext context = Threads(2);
  context.stop = stop.get_token();
  int reports = 0;
  context.progress = [&](const Progress&) {
    ++reports;
    stop.request_stop();
  };
  const auto field = SampleDisplacement(scan.cloud, domain.refinement, domain.rings, domain.limit,
                                        DisplacementOptions(), context);
  EXPECT_EQ(field.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(reports, 1);
}

TEST(DisplacementOptionsTest, EachFieldIsChecked) {
  EXPECT_TRUE(DisplacementOptions().Validate().ok());
  const auto message = [](const std::function<void(DisplacementOptions*)>& spoil) {
    DisplacementOptions options;
    spoil(&options);
    return std::string(options.Validate().message());
  };
  using ::testing::HasSubstr;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message([](auto* o) { o->max_height = 0.6; }), HasSubstr("max_height"));
  EXPECT_THAT(message([](auto* o) { o->max_height = kNan; }), HasSubstr("max_height"));
  EXPECT_THAT(message([](auto* o) { o->min_normal_agreement = 1; }), HasSubstr("agreement"));
}

}  // namespace
}  // namespace rilievo
