// Views of the scanner simulator, displaced by a known move each.
#include "core/registration/align_scans.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/scans/analytic_shape.h"
#include "tests/scans/displaced_views.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr double kNoise = 0.001;

std::vector<DisplacedView> Views(const std::string& shape, const ScannerOptions& scanner,
                                 const Displacement& displacement = {5, 0.03, 1}) {
  const SimulatedScan scan = SimulateScan(**MakeShape(shape), scanner).value();
  return DisplaceViews(scan, displacement);
}

std::vector<PointCloud> CloudsOf(const std::vector<DisplacedView>& views) {
  std::vector<PointCloud> clouds;
  for (const DisplacedView& view : views) clouds.push_back(view.cloud);
  return clouds;
}

using Moves = std::vector<Eigen::Isometry3d>;

// RMS distance of the points from where they were seen, all scans together.
double ErrorOf(const std::vector<DisplacedView>& views, const Moves& moves, double diagonal) {
  double sum = 0, count = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const Eigen::Matrix3Xd& points = views[i].cloud.points;
    const Eigen::Matrix3Xd truth = views[i].moved.inverse() * points;
    sum += (moves[i] * points - truth).squaredNorm();
    count += static_cast<double>(points.cols());
  }
  return std::sqrt(sum / count) / diagonal;
}

double ErrorOf(const std::vector<DisplacedView>& views, const Alignment& alignment) {
  return ErrorOf(views, alignment.moves, alignment.diagonal);
}

Alignment Align(const std::vector<PointCloud>& clouds, const AlignmentOptions& options = {}) {
  const auto alignment = AlignScans(clouds, options, RunContext{});
  EXPECT_TRUE(alignment.ok()) << alignment.status();
  return alignment.value_or(Alignment{});
}

class AlignedShapes : public testing::TestWithParam<const char*> {};

// Shapes without a symmetry along which they could slide.
INSTANTIATE_TEST_SUITE_P(AlignScansTest, AlignedShapes,
                         testing::Values("star", "genus2", "terrain"));

TEST_P(AlignedShapes, FiveNoisyViewsComeTogetherBelowTheNoise) {
  const std::vector<DisplacedView> views =
      Views(GetParam(), {.points = 40'000, .views = 5, .noise = kNoise});
  const Alignment alignment = Align(CloudsOf(views));
  EXPECT_TRUE(alignment.IsSound());
  EXPECT_TRUE(alignment.converged);
  EXPECT_GT(ErrorOf(views, Moves(5, Eigen::Isometry3d::Identity()), alignment.diagonal), 0.02);
  EXPECT_LT(ErrorOf(views, alignment), 0.5 * kNoise);
  EXPECT_TRUE(alignment.moves[0].isApprox(Eigen::Isometry3d::Identity()));
}

TEST(AlignScansTest, ViewsWithoutNoiseComeTogether) {
  const std::vector<DisplacedView> views = Views("star", {.points = 40'000, .views = 5});
  EXPECT_LT(ErrorOf(views, Align(CloudsOf(views))), 2e-4);
}

TEST(AlignScansTest, FiguresAreThoseOfThePairs) {
  const std::vector<DisplacedView> views =
      Views("star", {.points = 30'000, .views = 5, .noise = kNoise});
  const Alignment alignment = Align(CloudsOf(views));
  int overlapping = 0;
  for (const PairFigures& pair : alignment.pairs) {
    EXPECT_LT(pair.first, pair.second);
    EXPECT_EQ(pair.overlaps, pair.overlap >= 0.1);
    if (!pair.overlaps) continue;
    ++overlapping;
    EXPECT_LT(pair.overlap, 0.9);
    // Of the difference of two points, with noise along rays that meet the surface askew.
    EXPECT_GT(pair.rms, 0.4 * kNoise * alignment.diagonal);
    EXPECT_LT(pair.rms, 1.5 * kNoise * alignment.diagonal);
    EXPECT_TRUE(pair.fits);
  }
  EXPECT_GE(overlapping, 4);
  EXPECT_THAT(alignment.group, testing::Each(0));
}

// 50 degrees around three directions a third of a turn apart.
ScannerOptions NarrowViews() {
  return {.points = 30'000, .views = 3, .noise = kNoise, .max_incidence_degrees = 45};
}

TEST(AlignScansTest, ViewsThatDoNotOverlapAreToldApart) {
  for (const char* shape : {"sphere", "star"}) {
    for (const uint64_t seed : {1, 2}) {
      const Alignment alignment = Align(CloudsOf(Views(shape, NarrowViews(), {5, 0.03, seed})));
      EXPECT_FALSE(alignment.IsSound()) << shape << " " << seed;
      EXPECT_TRUE(std::any_of(alignment.group.begin(), alignment.group.end(),
                              [](int group) { return group != 0; }))
          << shape << " " << seed;
    }
  }
}

TEST(AlignScansTest, OtherShapesDoNotFit) {
  std::vector<PointCloud> clouds = CloudsOf(Views("star", {.points = 40'000, .views = 2}));
  clouds[1] = CloudsOf(Views("genus2", {.points = 40'000, .views = 2}))[1];
  clouds[1].points *= (clouds[0].points.rowwise().maxCoeff()).norm() /
                      (clouds[1].points.rowwise().maxCoeff()).norm();
  EXPECT_FALSE(Align(clouds).IsSound());
}

// Each view is stretched along an axis of its own: near to each other they fit, all together not.
TEST(AlignScansTest, ViewsThatAreBentDoNotFit) {
  std::vector<PointCloud> clouds =
      CloudsOf(Views("star", {.points = 30'000, .views = 5, .noise = 0.0003}, {1, 0.01, 1}));
  for (size_t i = 0; i < clouds.size(); ++i) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(1.2 * static_cast<double>(i), Eigen::Vector3d::UnitZ())
            .toRotationMatrix();
    const Eigen::Matrix3d stretch =
        turn * Eigen::Vector3d(1.1, 1, 1).asDiagonal() * turn.transpose();
    clouds[i].points = (stretch * clouds[i].points).eval();
    clouds[i].sights = {};
  }
  const Alignment alignment = Align(clouds);
  EXPECT_FALSE(alignment.IsSound());
  EXPECT_TRUE(std::any_of(alignment.pairs.begin(), alignment.pairs.end(),
                          [](const PairFigures& pair) { return pair.overlaps && !pair.fits; }));
}

TEST(AlignScansTest, AnyNumberOfThreadsFindsTheSame) {
  const std::vector<PointCloud> clouds =
      CloudsOf(Views("star", {.points = 30'000, .views = 3, .noise = kNoise}));
  RunContext one, four;
  one.threads = 1;
  four.threads = 4;
  const Alignment a = AlignScans(clouds, {}, one).value(), b = AlignScans(clouds, {}, four).value();
  for (size_t i = 0; i < clouds.size(); ++i) {
    EXPECT_EQ(a.moves[i].matrix(), b.moves[i].matrix());
  }
}

// On a map the coordinates are thousands of diagonals from zero.
TEST(AlignScansTest, FarFromTheOriginNothingIsLost) {
  std::vector<DisplacedView> views = Views("star", {.points = 30'000, .views = 5, .noise = kNoise});
  const Eigen::Translation3d far(5e5, 5.8e6, 100);
  for (DisplacedView& view : views) {
    const Eigen::Isometry3d out(far);
    MoveCloud(out, &view.cloud);
    view.moved = out * view.moved * out.inverse();
  }
  EXPECT_LT(ErrorOf(views, Align(CloudsOf(views))), 0.5 * kNoise);
}

TEST(AlignScansTest, MovesTakeStationsAndNormalsAlong) {
  PointCloud cloud{Eigen::Matrix3Xd::Identity(3, 3)};
  cloud.sights.stations = Eigen::Vector3d(2, 0, 0);
  cloud.sights.station_of = {0, 0, kNoStation};
  cloud.sights.normals = Eigen::Matrix3Xf::Identity(3, 3);
  Eigen::Isometry3d move(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ()));
  move.pretranslate(Eigen::Vector3d(0, 0, 5));
  MoveCloud(move, &cloud);
  EXPECT_TRUE(cloud.points.col(0).isApprox(Eigen::Vector3d(0, 1, 5)));
  EXPECT_TRUE(cloud.sights.stations.col(0).isApprox(Eigen::Vector3d(0, 2, 5)));
  EXPECT_TRUE(cloud.sights.normals.col(0).isApprox(Eigen::Vector3f(0, 1, 0)));
}

TEST(AlignScansTest, WhatCannotBeAlignedIsRefused) {
  const PointCloud one = CloudsOf(Views("star", {.points = 2000, .views = 2}))[0];
  const auto few = AlignScans(std::vector{one}, {}, RunContext{});
  EXPECT_THAT(few.status().message(), HasSubstr("at least two"));
  const PointCloud nothing{Eigen::Matrix3Xd::Zero(3, 5)};
  EXPECT_EQ(AlignScans(std::vector{one, nothing}, {}, RunContext{}).status().code(),
            absl::StatusCode::kInvalidArgument);
  AlignmentOptions options;
  options.reach = 2;
  EXPECT_THAT(AlignScans(std::vector{one, one}, options, RunContext{}).status().message(),
              HasSubstr("alignment.reach is 2"));
  RunContext stopped;
  std::stop_source source;
  source.request_stop();
  stopped.stop = source.get_token();
  EXPECT_EQ(AlignScans(std::vector{one, one}, {}, stopped).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
