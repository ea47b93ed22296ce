#include "core/scan/crease_normals.h"

#include <gtest/gtest.h>

#include <stop_token>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

struct NoisyScan {
  PreparedCloud prepared;
  EstimatedNormals estimated;
};

// Noise of a quarter of the spacing: one in five points by an edge gets no plane of its side.
NoisyScan Noisy(KnownCloud known, double noise) {
  AddNoise(noise, 21, &known);
  NoisyScan scan{Prepare(known), {}};
  scan.estimated =
      EstimateNormals(scan.prepared.scan.points, scan.prepared.graph, {}, RunContext{}).value();
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
  ASSERT_TRUE(
      SharpenNormals(scan->prepared.graph, scan->estimated.bent, context, &scan->estimated.cloud)
          .ok());
}

TEST(CreaseNormalsTest, PointsByAnEdgeTakeTheNormalsOfTheirSides) {
  NoisyScan scan = Noisy(BoxCloud(30000, 9, {1, 1, 1}), 0.004);
  const double before = ShareTilted(scan);
  Sharpen(&scan);
  EXPECT_GT(before, 0.04);
  EXPECT_LT(ShareTilted(scan), 0.35 * before);
}

TEST(CreaseNormalsTest, NormalsKeepTheirSigns) {
  NoisyScan scan = Noisy(BoxCloud(30000, 9, {1, 1, 1}), 0.004);
  for (int64_t i = 0; i < scan.estimated.cloud.normals.cols(); i += 2) {
    scan.estimated.cloud.normals.col(i) *= -1;
  }
  const Eigen::Matrix3Xd before = scan.estimated.cloud.normals;
  Sharpen(&scan);
  const Eigen::Matrix3Xd& after = scan.estimated.cloud.normals;
  EXPECT_GT((before.array() * after.array()).colwise().sum().minCoeff(), 0);
  EXPECT_LT((after.colwise().norm().array() - 1).abs().maxCoeff(), 1e-9);
  EXPECT_NE(before, after);
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
  EXPECT_TRUE(scan.estimated.bent.empty());
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
      SharpenNormals(one.prepared.graph, one.estimated.bent, context, &one.estimated.cloud).code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
