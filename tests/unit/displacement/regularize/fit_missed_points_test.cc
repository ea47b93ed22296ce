#include "core/displacement/regularize/fit_missed_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <vector>

#include "core/surface/closest_point_tree.h"
#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;
using Eigen::Vector3d;

constexpr double kHalf = 0.3;
constexpr int kCells = 32, kLevel = 1;
constexpr double kStep = kHalf / kCells;  // between vertices

// A sheet of points, about as dense as the vertices of the domain below.
Points SheetPoints() {
  Random random(5);
  return HeightFieldPoints(kHalf, 4096, &random, [](double, double) { return 0.0; });
}

// A cone over (x, y), two steps high or deep, narrow for the vertices' steps; in the sheet's place.
struct Tip {
  double x, y, up = 2 * kStep;
};
constexpr double kFoot = 1.5 * kStep;

Points WithTips(const std::vector<Tip>& tips) {
  const Points sheet = SheetPoints();
  Points points;
  const auto under = [&](const Vector3d& at) {
    return std::any_of(tips.begin(), tips.end(), [&](const Tip& tip) {
      return std::hypot(at.x() - tip.x, at.y() - tip.y) < kFoot;
    });
  };
  for (size_t i = 0; i < sheet.at.size(); ++i) {
    if (!under(sheet.at[i])) points.Add(sheet.at[i], sheet.normal[i]);
  }
  for (const Tip& tip : tips) {
    for (int k = 0; k < 60; ++k) {
      const double high = (k + 0.5) / 60, angle = 2.4 * k;  // the golden angle
      const Vector3d way(std::cos(angle), std::sin(angle), 0);
      const Vector3d at = Vector3d(tip.x, tip.y, high * tip.up) + (1 - high) * kFoot * way;
      points.Add(at, tip.up * way + kFoot * Vector3d::UnitZ());
    }
  }
  return points;
}

Scan ScanOf(const Points& points, double noise = 0) {
  return MakeScan(points.Positions(), points.Normals(), noise);
}

struct Reached {
  explicit Reached(const ControlMesh& mesh = Sheet(kHalf, kCells))
      : domain(MakeDomain(mesh, kLevel)), samples(static_cast<size_t>(domain.size())) {
    std::fill(samples.measured.begin(), samples.measured.end(), 1);
    std::fill(samples.spacing.begin(), samples.spacing.end(), static_cast<float>(kStep));
  }
  absl::Status Run(const Scan& scan, const RunContext& context = Threads(2)) {
    const auto bounded = [&](int, float height) { return std::clamp(height, -bound, bound); };
    return FitMissedPoints(scan.cloud, scan.graph, domain.refinement, domain.rings, domain.limit,
                           bounded, context, &samples);
  }
  // From the surface to the farthest of the points.
  double FarthestOff(const Eigen::Matrix3Xd& points) const {
    Eigen::Matrix3Xd places = domain.limit.positions;
    for (int v = 0; v < domain.size(); ++v) {
      places.col(v) += samples.height[v] * domain.limit.normals.col(v);
    }
    const auto tree = ClosestPointTree::Build(places, FinestFaces(domain.refinement), RunContext());
    double most = 0;
    for (const auto& point : points.colwise()) {
      most = std::max(most, tree->Closest(point).squared_distance);
    }
    return std::sqrt(most);
  }
  int Moved() const {
    return static_cast<int>(std::count_if(samples.height.begin(), samples.height.end(),
                                          [](float height) { return height != 0; }));
  }
  Domain domain;
  HeightSamples samples;
  float bound = 0.2f;
};

TEST(FitMissedPointsTest, TheSurfaceComesToTipsThatItPassedBy) {
  const std::vector<Tip> tips = {{0.3 * kStep, 7.2 * kStep}, {-9.6 * kStep, 0, -2 * kStep}};
  const Scan scan = ScanOf(WithTips(tips));
  Reached reached;
  EXPECT_GT(reached.FarthestOff(scan.cloud.points), 1.9 * kStep);
  ASSERT_TRUE(reached.Run(scan).ok());
  EXPECT_LT(reached.FarthestOff(scan.cloud.points), 0.7 * kStep);
  EXPECT_LE(reached.Moved(), 24) << "no height but those by the tips";
  for (int v = 0; v < reached.domain.size(); ++v) {
    EXPECT_EQ(reached.samples.fitted[v] != 0, reached.samples.height[v] != 0);
    EXPECT_LT(std::abs(reached.samples.height[v]), 2.6 * kStep) << "no spike";
  }
}

TEST(FitMissedPointsTest, AFillThatMovedCountsAsMeasured) {
  Reached reached;
  std::fill(reached.samples.measured.begin(), reached.samples.measured.end(), 0);
  std::fill(reached.samples.spacing.begin(), reached.samples.spacing.end(), 0.0f);
  ASSERT_TRUE(reached.Run(ScanOf(WithTips({{0, 0}}))).ok());
  ASSERT_GT(reached.Moved(), 0);
  for (int v = 0; v < reached.domain.size(); ++v) {
    EXPECT_EQ(reached.samples.measured[v] != 0, reached.samples.height[v] != 0);
  }
}

TEST(FitMissedPointsTest, WhatIsNoPartOfTheSurfaceDoesNotPull) {
  const auto moved = [](const Points& points, double noise = 0) {
    Reached reached;
    EXPECT_TRUE(reached.Run(ScanOf(points, noise)).ok());
    return reached.Moved();
  };
  EXPECT_GT(moved(WithTips({{0, 0}})), 0);
  EXPECT_EQ(moved(WithTips({{0, 0}}), 0.5 * kStep), 0) << "within the noise";
  Points turned = WithTips({{0, 0}});
  for (Vector3d& normal : turned.normal) normal = -normal;
  EXPECT_EQ(moved(turned), 0) << "facing the other way";
  for (const double up : {0.8, 1.5, 3.0, 6.0}) {
    Points points = SheetPoints();
    points.Add({0, 0, up * kStep}, Vector3d::UnitZ());
    points.Add({5 * kStep, 0, up * kStep}, Vector3d(1, 0, 1));
    EXPECT_EQ(moved(points), 0) << "outliers " << up;
  }
  for (const double up : {1.0, 1.4, 2.0, 3.0}) {
    Points shells = SheetPoints();
    for (const Vector3d& at : SheetPoints().at) {
      shells.Add(at + up * kStep * Vector3d::UnitZ(), Vector3d::UnitZ());
    }
    EXPECT_EQ(moved(shells), 0) << "another shell " << up;
  }
  Random random(8);
  const Points wider = HeightFieldPoints(1.2 * kHalf, 6000, &random, [](double x, double) {
    return std::max(0.0, std::abs(x) - kHalf);
  });
  EXPECT_EQ(moved(wider), 0) << "beyond the rim";
}

TEST(FitMissedPointsTest, CoarseSurfacesDoNotFollowEveryPoint) {
  Reached coarse(Sheet(kHalf, 4));  // steps 8 times as long
  ASSERT_TRUE(coarse.Run(ScanOf(WithTips({{0, 0}}))).ok());
  EXPECT_EQ(coarse.Moved(), 0);
}

TEST(FitMissedPointsTest, KeepsBounds) {
  Reached reached;
  reached.bound = static_cast<float>(0.7 * kStep);
  ASSERT_TRUE(reached.Run(ScanOf(WithTips({{0, 0}}))).ok());
  EXPECT_GT(reached.Moved(), 0);
  for (const float height : reached.samples.height) EXPECT_LE(std::abs(height), reached.bound);
}

TEST(FitMissedPointsTest, ThreadsDoNotMatterAndStopsAreHeard) {
  std::vector<Tip> tips;
  for (int k = 0; k < 36; ++k)
    tips.push_back({(k % 6 - 2.7) * 8 * kStep, (k / 6 - 2.6) * 8 * kStep});
  const Scan scan = ScanOf(WithTips(tips));
  Reached one, four;
  ASSERT_TRUE(one.Run(scan, Threads(1)).ok());
  ASSERT_TRUE(four.Run(scan, Threads(4)).ok());
  EXPECT_GT(one.Moved(), 100);
  EXPECT_EQ(one.samples.height, four.samples.height);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(Reached().Run(scan, context).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
