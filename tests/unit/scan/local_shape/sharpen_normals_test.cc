#include "core/scan/local_shape/sharpen_normals.h"

#include <gtest/gtest.h>

#include <stop_token>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

struct NoisyScan {
  PreparedCloud prepared;
  EstimatedNormals estimated;
};

// `noise`: standard deviation in each coordinate; a box of 30 000 points has a spacing of 0.016.
NoisyScan Noisy(KnownCloud known, double noise) {
  AddNoise(noise, 21, &known);
  NoisyScan scan{Prepare(known), {}};
  scan.estimated =
      EstimateNormals(scan.prepared.scan.points, scan.prepared.graph, {}, {}, RunContext{}).value();
  return scan;
}

// Of the points, how many normals lie more than 20 degrees off.
double ShareTilted(const NoisyScan& scan) {
  const Eigen::ArrayXd cosines =
      (scan.estimated.cloud.normals.array() * scan.prepared.normals.array())
          .colwise()
          .sum()
          .abs()
          .transpose();
  return (cosines < std::cos(20 * std::numbers::pi / 180)).cast<double>().mean();
}

void Sharpen(NoisyScan* scan, const RunContext& context = RunContext{}) {
  ASSERT_TRUE(SharpenNormals(scan->prepared.graph, scan->estimated.near_edge, context,
                             &scan->estimated.cloud)
                  .ok());
}

TEST(CreaseNormalsTest, PointsByAnEdgeTakeTheNormalsOfTheirSides) {
  NoisyScan scan = Noisy(BoxCloud(30000, 9, {1, 1, 1}), 0.004);
  const double before = ShareTilted(scan);
  Sharpen(&scan);
  EXPECT_GT(before, 0.04);
  EXPECT_LT(ShareTilted(scan), 0.35 * before);
}

// A point's own normal, which may be the other side's at a right angle, says little of its sign;
// the points of its side together do.
TEST(CreaseNormalsTest, TheNormalsOfASideSayItsSign) {
  for (const double sign : {1.0, -1.0}) {
    NoisyScan scan = Noisy(BoxCloud(30000, 9, {1, 1, 1}), 0.004);
    Eigen::Matrix3Xd& normals = scan.estimated.cloud.normals;
    const Eigen::Matrix3Xd& points = scan.prepared.scan.points;
    const Eigen::Vector3d center = (points.rowwise().minCoeff() + points.rowwise().maxCoeff()) / 2;
    const auto outward = [&](int64_t i) {
      return sign * normals.col(i).dot(points.col(i) - center);
    };
    for (int64_t i = 0; i < normals.cols(); ++i) {
      if ((outward(i) < 0) != (i % 8 == 0)) normals.col(i) *= -1;
    }
    const Eigen::Matrix3Xd before = normals;
    Sharpen(&scan);
    EXPECT_LT((normals.colwise().norm().array() - 1).abs().maxCoeff(), 1e-9);
    int changed = 0, turned = 0, wrong = 0;
    for (int64_t i = 0; i < normals.cols(); ++i) {
      if (normals.col(i) == before.col(i)) continue;
      ++changed;
      if (i % 8 == 0) ++turned;
      if (outward(i) < 0) ++wrong;
    }
    EXPECT_GT(changed, 1000);
    EXPECT_GT(turned, 100);
    EXPECT_EQ(wrong, 0);
  }
}

TEST(CreaseNormalsTest, ASmoothSurfaceHasNoSides) {
  NoisyScan scan = Noisy(TorusCloud(30000, 3), 0.008);
  const Eigen::Matrix3Xd before = scan.estimated.cloud.normals;
  Sharpen(&scan);
  const auto changed = (before - scan.estimated.cloud.normals).colwise().norm().array() > 0;
  EXPECT_LT(changed.cast<double>().mean(), 0.005);
}

TEST(CreaseNormalsTest, CleanPointsAreNotBent) {
  const NoisyScan scan = Noisy(BoxCloud(30000, 9, {1, 1, 1}), 0);
  EXPECT_TRUE(scan.estimated.near_edge.empty());
}

TEST(CreaseNormalsTest, ThreadsDoNotMatterAndStopsAreHeard) {
  NoisyScan one = Noisy(BoxCloud(8000, 9, {1, 1, 1}), 0.008);
  NoisyScan four = Noisy(BoxCloud(8000, 9, {1, 1, 1}), 0.008);
  RunContext context;
  context.threads = 1;
  Sharpen(&one, context);
  context.threads = 4;
  Sharpen(&four, context);
  EXPECT_EQ(one.estimated.cloud.normals, four.estimated.cloud.normals);
  std::stop_source source;
  source.request_stop();
  context.stop = source.get_token();
  EXPECT_EQ(
      SharpenNormals(one.prepared.graph, one.estimated.near_edge, context, &one.estimated.cloud)
          .code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
