#include "core/scan/clean/check_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/scan/clean/settings.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<CheckedScan> Check(const PointCloud& cloud) {
  return CheckScan(cloud, CheckOptions{}, RunContext{});
}

// `rounding`: of the input, as a share of the diagonal.
void ExpectUnitFrame(const CheckedScan& scan, double rounding = 1e-12) {
  const Eigen::Vector3d low = scan.points.rowwise().minCoeff();
  const Eigen::Vector3d high = scan.points.rowwise().maxCoeff();
  EXPECT_NEAR((high - low).norm(), 1, rounding);
  EXPECT_LT((high + low).norm(), rounding);
}

// Columns of `scan` are where the source points were, to `tolerance` of the diagonal.
void ExpectSource(const CheckedScan& scan, const PointCloud& cloud, double tolerance) {
  ASSERT_EQ(scan.source_index.size(), static_cast<size_t>(scan.points.cols()));
  for (int i = 0; i < scan.points.cols(); ++i) {
    const Eigen::Vector3d back = scan.frame.ScanFromUnit(scan.points.col(i));
    ASSERT_LE((back - cloud.points.col(scan.source_index[i])).norm(),
              tolerance * scan.frame.diagonal);
  }
}

TEST(CheckScanTest, PutsPointsInTheUnitFrame) {
  const KnownCloud sphere = SphereCloud(500, 1, 3.0, {10, -20, 5});
  const auto scan = Check(sphere.cloud);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points.cols(), 500);
  EXPECT_FALSE(scan->planar);
  ExpectUnitFrame(*scan);
  ExpectSource(*scan, sphere.cloud, 1e-14);
}

TEST(CheckScanTest, DropsAndCountsNonFinitePoints) {
  KnownCloud sphere = SphereCloud(400, 2);
  sphere.cloud.points(0, 7) = std::numeric_limits<double>::quiet_NaN();
  sphere.cloud.points(1, 8) = std::numeric_limits<double>::infinity();
  sphere.cloud.points(2, 9) = -std::numeric_limits<double>::infinity();
  const auto scan = Check(sphere.cloud);
  ASSERT_TRUE(scan.ok());
  EXPECT_EQ(scan->non_finite, 3);
  EXPECT_EQ(scan->points.cols(), 397);
  EXPECT_TRUE(scan->points.allFinite());
}

TEST(CheckScanTest, DropsExactDuplicatesAndKeepsTheFirst) {
  const KnownCloud once = SphereCloud(300, 3);
  PointCloud five{once.cloud.points.replicate(1, 5)};
  const auto scan = Check(five);
  const auto single = Check(once.cloud);
  ASSERT_TRUE(scan.ok() && single.ok());
  EXPECT_EQ(scan->duplicates, 1200);
  EXPECT_EQ(scan->points, single->points);
  for (const int source : scan->source_index) EXPECT_LT(source, 300);
}

// Against all pairs, at a distance that makes cells of several levels matter.
TEST(CheckScanTest, NearDuplicatesMatchBruteForce) {
  const KnownCloud sphere = SphereCloud(3000, 4);
  for (const double distance : {1e-9, 1e-3, 0.01}) {
    CheckOptions options;
    options.duplicate_distance = distance;
    const auto scan = CheckScan(sphere.cloud, options, RunContext{});
    ASSERT_TRUE(scan.ok());
    EXPECT_EQ(scan->points.cols() + scan->duplicates, 3000);
    for (int i = 0; i < scan->points.cols(); ++i) {
      for (int j = 0; j < i; ++j) {
        ASSERT_GE((scan->points.col(i) - scan->points.col(j)).norm(), distance * (1 - 1e-9));
      }
    }
    // Each dropped point is close to a kept one.
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Vector3d unit = scan->frame.UnitFromScan(sphere.cloud.points.col(i));
      ASSERT_LE((scan->points.colwise() - unit).colwise().norm().minCoeff(), distance);
    }
    EXPECT_EQ(scan->duplicates > 500, distance == 0.01);
  }
}

TEST(CheckScanTest, ScaleAndOffsetChangeNothing) {
  const KnownCloud sphere = SphereCloud(400, 5);
  const auto reference = Check(sphere.cloud);
  ASSERT_TRUE(reference.ok());
  for (const double scale : {1e-30, 1e-150, 1.0, 1e30, 1e150}) {
    const PointCloud scaled{sphere.cloud.points * scale};
    const auto scan = Check(scaled);
    ASSERT_TRUE(scan.ok()) << scale << scan.status();
    ASSERT_EQ(scan->points.cols(), 400) << scale;
    EXPECT_LT((scan->points - reference->points).cwiseAbs().maxCoeff(), 1e-12) << scale;
    EXPECT_EQ(scan->source_index, reference->source_index) << scale;
  }
}

// The offsets of a map grid, which float32 rounds to half a metre.
TEST(CheckScanTest, LargeOffsetsCostNothing) {
  const KnownCloud sphere = SphereCloud(400, 6, 5.0);
  PointCloud moved = sphere.cloud;
  moved.points.colwise() += Eigen::Vector3d(500000, 4600000, 300);
  const auto scan = Check(moved);
  ASSERT_TRUE(scan.ok());
  ExpectUnitFrame(*scan, 1e-10);
  // Rounding of the input itself: half an ulp of 4.6e6 over the diagonal.
  ExpectSource(*scan, moved, 1e-10);
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d back = scan->points.col(i) * scan->frame.diagonal;
    const Eigen::Vector3d local = moved.points.col(scan->source_index[i]) - scan->frame.center;
    ASSERT_LT((back - local).norm(), 1e-12);
  }
}

TEST(CheckScanTest, OrderOfThePointsDoesNotMatter) {
  const KnownCloud torus = TorusCloud(1000, 7);
  PointCloud reversed{torus.cloud.points.rowwise().reverse()};
  const auto a = Check(torus.cloud);
  const auto b = Check(reversed);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->points, b->points);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(a->source_index[i], 999 - b->source_index[i]);
}

TEST(CheckScanTest, MortonOrderKeepsNeighboursTogether) {
  const auto scan = Check(SphereCloud(20000, 8).cloud);
  ASSERT_TRUE(scan.ok());
  double steps = 0;
  for (int i = 1; i < scan->points.cols(); ++i) {
    steps += (scan->points.col(i) - scan->points.col(i - 1)).norm();
  }
  // Random order steps 0.38 of the diagonal on average, the spacing is 0.008.
  EXPECT_LT(steps / 20000, 0.02);
}

TEST(CheckScanTest, OneFarPointDoesNotOwnTheFrame) {
  KnownCloud sphere = SphereCloud(400, 9);
  PointCloud cloud{Eigen::Matrix3Xd(3, 401)};
  cloud.points << sphere.cloud.points, Eigen::Vector3d(1e9, 0, 0);
  const auto scan = Check(cloud);
  ASSERT_TRUE(scan.ok());
  EXPECT_EQ(scan->strays, 1);
  EXPECT_EQ(scan->points.cols(), 400);
  EXPECT_NEAR(scan->frame.diagonal, 2 * std::sqrt(3.0), 0.1);
}

TEST(CheckScanTest, FarPartsOfARealSceneStay) {
  // A hundredth of the points in a street 30 room sizes away.
  const KnownCloud scene = Concatenate(SphereCloud(9900, 10), SphereCloud(100, 11, 2, {60, 0, 0}));
  const auto scan = Check(scene.cloud);
  ASSERT_TRUE(scan.ok());
  EXPECT_EQ(scan->strays, 0);
  EXPECT_EQ(scan->points.cols(), 10000);
}

TEST(CheckScanTest, RefusesTooFewWithCounts) {
  KnownCloud sphere = SphereCloud(kCheckScan.min_scan_points + 4, 12);
  sphere.cloud.points.col(0).setConstant(std::numeric_limits<double>::quiet_NaN());
  for (int i = 1; i < 5; ++i) sphere.cloud.points.col(i) = sphere.cloud.points.col(5);
  const auto scan = Check(sphere.cloud);
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(scan.status().message(), HasSubstr("19 distinct finite points"));
  EXPECT_THAT(scan.status().message(), HasSubstr("1 non-finite, 4 duplicates"));
  EXPECT_EQ(Check(PointCloud{}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(Check(SphereCloud(kCheckScan.min_scan_points, 13).cloud).ok());
}

TEST(CheckScanTest, RefusesIdenticalPoints) {
  const PointCloud same{Eigen::Vector3d(1, 2, 3).replicate(1, 500)};
  const auto scan = Check(same);
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(scan.status().message(), HasSubstr("all 500 finite points are identical"));
}

TEST(CheckScanTest, RefusesCollinearPointsEvenWhenRoundedToFloat) {
  Random random(14);
  PointCloud line{Eigen::Matrix3Xd(3, 500)};
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d point = Eigen::Vector3d(1, 2, 3) * random.Uniform();
    line.points.col(i) = point.cast<float>().cast<double>();
  }
  const auto scan = Check(line);
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(scan.status().message(), HasSubstr("collinear"));
}

TEST(CheckScanTest, AcceptsACoplanarScanAndSaysSo) {
  KnownCloud plane = PlaneCloud(600, 15);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()));
  plane.cloud.points = turn * plane.cloud.points;
  const auto scan = Check(plane.cloud);
  ASSERT_TRUE(scan.ok());
  EXPECT_TRUE(scan->planar);
  EXPECT_EQ(scan->points.cols(), 600);
}

TEST(CheckScanTest, RefusesWhatNoFrameHolds) {
  const KnownCloud clouds[] = {SphereCloud(100, 16, 1.7e308), SphereCloud(100, 16, 1e300),
                               SphereCloud(100, 16, 1e290, {0, -1e301, 0})};
  for (const KnownCloud& sphere : clouds) {
    const auto scan = Check(sphere.cloud);
    EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(scan.status().message(), HasSubstr("too large"));
  }
  EXPECT_TRUE(Check(SphereCloud(100, 16, 1e299).cloud).ok());
}

TEST(CheckScanTest, ValidatesOptionsAndStops) {
  CheckOptions options;
  for (const double bad : {-1e-9, 0.02, std::numeric_limits<double>::quiet_NaN()}) {
    options.duplicate_distance = bad;
    EXPECT_EQ(options.Validate().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_FALSE(CheckScan(SphereCloud(100, 17).cloud, options, RunContext{}).ok());
  }
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(CheckScan(SphereCloud(100, 17).cloud, CheckOptions{}, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
