// A surface brought up to date by a new scan.
#include "core/pipeline/update_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <string>
#include <vector>

#include "core/codec/container/dss.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/points_on_surface.h"
#include "core/pipeline/reconstruct.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"
#include "tests/unit/surface/whole_folds.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kPlace(0.9, 0.3, 0.3);  // of what changes, on a ball of radius 1

PointCloud BallScan(int points, double noise, uint64_t seed) {
  ScannerOptions scanner;
  scanner.points = points;
  scanner.views = 0;
  scanner.noise = noise;
  scanner.seed = seed;
  return SimulateScan(**MakeShape("sphere"), scanner)->cloud;
}

// With a bump of this height around kPlace.
PointCloud Changed(PointCloud scan, double height) {
  const Eigen::Vector3d way = kPlace.normalized();
  for (auto point : scan.points.colwise()) {
    const double away = (point.normalized() - way).norm() / 0.4;
    if (away < 1) point *= 1 + height * std::pow(1 - away * away, 2);
  }
  return scan;
}

PointCloud Near(const PointCloud& scan, double radius) {
  std::vector<int> near;
  for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
    if ((scan.points.col(i).normalized() - kPlace.normalized()).norm() < radius) {
      near.push_back(static_cast<int>(i));
    }
  }
  return {Eigen::Matrix3Xd(scan.points(Eigen::all, near))};
}

std::vector<uint8_t> SurfaceOf(const PointCloud& scan) {
  return Reconstruct(scan, {}, {})->encoded.Concatenate();
}

DistanceSummary ErrorAgainst(const std::vector<uint8_t>& dss, const PointCloud& scan) {
  const DisplacedSurface surface = DecodeDss(dss, {})->surface;
  const Shape triangles = *FinestTriangles(surface, {});
  return SummaryOf(LayOnSurface(scan, surface.frame, triangles, {})->away);
}

TEST(UpdateSurfaceTest, AScanThatAgreesChangesNothing) {
  for (const double noise : {0.0, 3e-3}) {
    const std::vector<uint8_t> before = SurfaceOf(BallScan(6000, noise, 1));
    const auto update = UpdateSurface(before, BallScan(9000, noise, 2), {.whole = true}, {});
    ASSERT_TRUE(update.ok()) << update.status();
    EXPECT_EQ(update->dss, before) << "noise " << noise;
    EXPECT_EQ(update->report.heights_anew, 0);
  }
}

TEST(UpdateSurfaceTest, WhatChangedIsAsExactAsARebuild) {
  for (const double noise : {0.0, 2e-3}) {
    const PointCloud old_scan = BallScan(8000, noise, 1);
    const PointCloud scan = Changed(BallScan(8000, noise, 2), 0.06);
    const std::vector<uint8_t> before = SurfaceOf(old_scan), rebuilt = SurfaceOf(scan);
    // Of the whole, or of the place alone.
    for (const PointCloud& given : {scan, Near(scan, 0.6)}) {
      const auto update = UpdateSurface(before, given, {}, {});
      ASSERT_TRUE(update.ok()) << update.status();
      EXPECT_TRUE(std::equal(before.begin(), before.end(), update->dss.begin()));
      EXPECT_EQ(update->dss.size(),
                before.size() + static_cast<size_t>(update->report.update_bytes));
      EXPECT_EQ(CountFolds(DecodeDss(update->dss, {})->surface), 0);
      EXPECT_LT(ErrorAgainst(update->dss, scan).rms, 1.05 * ErrorAgainst(rebuilt, scan).rms);
      EXPECT_NEAR(ErrorAgainst(update->dss, given).rms, update->report.after.rms, 1e-9);
      const DecodedSurface old_surface = *DecodeDss(before, {}), now = *DecodeDss(update->dss, {});
      int64_t moved = 0;
      for (size_t v = 0; v < now.surface.heights.size(); ++v) {
        moved += now.surface.heights[v] != old_surface.surface.heights[v] ? 1 : 0;
      }
      EXPECT_LE(moved, update->report.heights_anew);
      EXPECT_LT(update->report.heights_anew, update->report.heights / 5);
    }
  }
}

TEST(UpdateSurfaceTest, OfAWholeScanGapsAreFilled) {
  const std::vector<uint8_t> before = SurfaceOf(BallScan(8000, 0, 1));
  PointCloud scan = BallScan(8000, 0, 2);
  std::vector<int> far;
  for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
    if (scan.points(2, i) > -0.8) far.push_back(static_cast<int>(i));
  }
  scan.points = scan.points(Eigen::all, far).eval();
  EXPECT_EQ(UpdateSurface(before, scan, {}, {})->dss, before);
  const auto update = UpdateSurface(before, scan, {.whole = true}, {});
  ASSERT_TRUE(update.ok()) << update.status();
  EXPECT_GT(update->report.heights_filled, 100);
  EXPECT_EQ(update->report.heights_filled, update->report.heights_anew);
  const DecodedSurface now = *DecodeDss(update->dss, {});
  const Shape triangles = *FinestTriangles(now.surface, {});
  for (size_t v = 0; v < now.surface.sources.size(); ++v) {
    if (now.surface.sources[v] != HeightSource::kFilled) continue;
    const Eigen::Vector3d unit = triangles.vertices.col(static_cast<Eigen::Index>(v));
    EXPECT_LT(now.surface.frame.ScanFromUnit(unit).z(), -0.75);
  }
}

// A wavy sheet over [-1, x] x [-1, 1].
PointCloud Sheet(int points, double x, double shift) {
  PointCloud sheet;
  sheet.points.resize(3, points * points);
  for (int i = 0; i < points; ++i) {
    for (int j = 0; j < points; ++j) {
      const double u = (i + shift) / points * (x + 1) - 1, v = 2 * (j + shift) / points - 1;
      sheet.points.col(i * points + j) << u, v, 0.1 * std::sin(3 * u) * std::cos(2 * v);
    }
  }
  return sheet;
}

TEST(UpdateSurfaceTest, PointsBeyondABorderSayNothing) {
  const std::vector<uint8_t> before = SurfaceOf(Sheet(60, 0.8, 0.2));
  const auto update = UpdateSurface(before, Sheet(60, 1, 0.5), {}, {});
  ASSERT_TRUE(update.ok()) << update.status();
  EXPECT_EQ(update->dss, before);
  EXPECT_GT(update->report.before.max, 0.05);
}

TEST(UpdateSurfaceTest, WhatHeightsDoNotReachIsRefused) {
  const PointCloud scan = BallScan(6000, 0, 1);
  const std::vector<uint8_t> before = SurfaceOf(scan);
  const auto refusal = [&](const PointCloud& given) {
    return UpdateSurface(before, given, {}, {}).status();
  };
  EXPECT_EQ(refusal(Changed(BallScan(6000, 0, 2), 0.8)).code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refusal(Changed(BallScan(6000, 0, 2), 0.8)).message()),
              HasSubstr("heights do not reach"));
  PointCloud elsewhere = scan;
  elsewhere.points.row(0).array() += 7;
  EXPECT_THAT(std::string(refusal(elsewhere).message()), HasSubstr("rilievo align"));
  EXPECT_EQ(refusal(PointCloud{Eigen::Matrix3Xd::Constant(3, 5, NAN)}).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(UpdateSurfaceTest, ThreadsDoNotMatterAndTheSixtyFifthUpdateIsRefused) {
  const std::vector<uint8_t> before = SurfaceOf(BallScan(4000, 0, 1));
  const PointCloud scan = Changed(BallScan(4000, 0, 2), 0.06);
  RunContext one, three;
  one.threads = 1;
  three.threads = 3;
  const auto updated = UpdateSurface(before, scan, {}, one);
  EXPECT_EQ(updated->dss, UpdateSurface(before, scan, {}, three)->dss);
  // Files take 64 updates.
  const std::vector<uint8_t> update(
      updated->dss.begin() + static_cast<std::ptrdiff_t>(before.size()), updated->dss.end());
  ASSERT_FALSE(update.empty());
  std::vector<uint8_t> full = before;
  for (int i = 0; i < 64; ++i) full.insert(full.end(), update.begin(), update.end());
  EXPECT_THAT(std::string(UpdateSurface(full, scan, {}, one).status().message()),
              HasSubstr("has 64 updates, and the format no more; reconstruct"));
  std::stop_source stop;
  stop.request_stop();
  one.stop = stop.get_token();
  EXPECT_EQ(UpdateSurface(before, scan, {}, one).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
