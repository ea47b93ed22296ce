#include "core/pipeline/heights_in_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/displacement/sample_displacement.h"
#include "core/loop/level_rings.h"
#include "core/pipeline/fit_domain.h"
#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

constexpr int kLevel = 3;

struct Setting {
  OrientedCloud cloud;
  ControlMesh mesh;
};

Setting Prepare(double noise, int points = 20000) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), points, noise);
  ControlMesh mesh =
      FitDomain(prepared.scan, prepared.control.mesh, {}, {}).value().fit.control_mesh;
  return {std::move(prepared.scan.cloud), std::move(mesh)};
}

DisplacementField Whole(const Setting& setting) {
  const LoopRefinement refinement = RefineToVertices(setting.mesh, kLevel, {}).value();
  const LimitSurface limit = EvaluateLimit(refinement, setting.mesh.vertices, kLevel, {}).value();
  return SampleDisplacement(setting.cloud, refinement,
                            LevelRings::After(refinement.levels[kLevel - 1]), limit, {}, {})
      .value();
}

DisplacementField InParts(const Setting& setting, int64_t part_vertices, int threads = 2) {
  RunContext context;
  context.threads = threads;
  const PartCutter cutter = PartCutter::Make(setting.mesh).value();
  return MeasureHeightsInParts(setting.cloud, setting.mesh, cutter, kLevel, part_vertices, {},
                               context)
      .value();
}

double RmsBetween(const std::vector<float>& a, const std::vector<float>& b) {
  double squares = 0;
  for (size_t v = 0; v < a.size(); ++v) squares += std::pow(double{a[v]} - b[v], 2);
  return std::sqrt(squares / static_cast<double>(a.size()));
}

TEST(MeasureHeightsInPartsTest, IsAsTheWhole) {
  for (const double noise : {0.0, 0.001}) {
    const Setting setting = Prepare(noise, 40000);
    const DisplacementField whole = Whole(setting), parts = InParts(setting, 8000);
    ASSERT_EQ(parts.heights.size(), whole.heights.size());
    ASSERT_GT(parts.heights.size(), 5 * 8000U);
    const double scale = std::max(setting.cloud.median_noise, 0.1 * setting.cloud.median_spacing);
    EXPECT_LT(RmsBetween(parts.heights, whole.heights), 0.1 * scale) << noise;
    EXPECT_EQ(parts.measured + parts.smoothed + parts.filled, std::ssize(parts.heights));
    EXPECT_NEAR(static_cast<double>(parts.smoothed), static_cast<double>(whole.smoothed),
                0.05 * static_cast<double>(parts.heights.size()));
    EXPECT_EQ(parts.filled, 0);
    // Each part counts the control points around it anew.
    EXPECT_NEAR(parts.leverage, whole.leverage, 0.4 * whole.leverage);
  }
}

// Points with a hole in them, many control faces wide, below a control mesh that lies 1 % off them,
// so that heights around the hole are not 0.
Setting WithHole() {
  Setting setting = Prepare(0);
  OrientedCloud& cloud = setting.cloud;
  std::vector<int> kept;
  for (int p = 0; p < cloud.points.cols(); ++p) {
    if ((cloud.points.col(p) - cloud.points.col(0)).norm() > 0.17) kept.push_back(p);
  }
  const OrientedCloud whole = std::move(cloud);
  cloud = {};
  cloud.points = whole.points(Eigen::all, kept);
  cloud.normals = whole.normals(Eigen::all, kept);
  for (const int p : kept) {
    cloud.spacing.push_back(whole.spacing[p]);
    cloud.noise.push_back(whole.noise[p]);
  }
  cloud.median_spacing = whole.median_spacing;
  cloud.median_noise = whole.median_noise;
  for (auto vertex : setting.mesh.vertices.colwise()) vertex *= 1.01;
  return setting;
}

TEST(MeasureHeightsInPartsTest, AHoleIsFilledAlikeFromAllSides) {
  const Setting setting = WithHole();
  const DisplacementField whole = Whole(setting), parts = InParts(setting, 1500);
  ASSERT_GT(whole.filled, 1500);
  EXPECT_NEAR(static_cast<double>(parts.filled), static_cast<double>(whole.filled),
              0.02 * static_cast<double>(whole.filled));
  // The largest step between two vertices of an edge is about that of the whole.
  const LoopRefinement refinement = RefineTopology(setting.mesh, kLevel, {}).value();
  const auto largest_step = [&](const DisplacementField& field) {
    double largest = 0;
    for (const auto ends : refinement.levels.back().edge_vertices.colwise()) {
      if (field.source[ends[0]] != HeightSource::kFilled) continue;
      largest =
          std::max<double>(largest, std::abs(field.heights[ends[0]] - field.heights[ends[1]]));
    }
    return largest;
  };
  EXPECT_LT(largest_step(parts), 1.5 * largest_step(whole));
}

TEST(MeasureHeightsInPartsTest, ThreadsChangeNothing) {
  const Setting setting = Prepare(0.001);
  const DisplacementField one = InParts(setting, 6000, 1), four = InParts(setting, 6000, 4);
  EXPECT_EQ(one.heights, four.heights);
  EXPECT_EQ(one.source, four.source);
  EXPECT_EQ(one.leverage, four.leverage);
}

TEST(MeasureHeightsInPartsTest, PartsMayBeAFewFaces) {
  const Setting setting = Prepare(0);
  const DisplacementField parts = InParts(setting, 500);
  EXPECT_LT(RmsBetween(parts.heights, Whole(setting).heights), 0.2 * setting.cloud.median_spacing);
}

TEST(MeasureHeightsInPartsTest, CanBeStopped) {
  const Setting setting = Prepare(0);
  RunContext context;
  std::stop_source stop;
  context.stop = stop.get_token();
  stop.request_stop();
  const PartCutter cutter = PartCutter::Make(setting.mesh).value();
  EXPECT_EQ(MeasureHeightsInParts(setting.cloud, setting.mesh, cutter, kLevel, 4000, {}, context)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
