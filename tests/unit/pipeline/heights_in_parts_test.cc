#include "core/pipeline/heights_in_parts.h"

#include <gtest/gtest.h>

#include <cmath>

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

Setting Prepare(double noise) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 40000, noise);
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
    const Setting setting = Prepare(noise);
    const DisplacementField whole = Whole(setting), parts = InParts(setting, 8000);
    ASSERT_EQ(parts.heights.size(), whole.heights.size());
    ASSERT_GT(parts.heights.size(), 5 * 8000U);
    const double scale = std::max(setting.cloud.median_noise, 0.1 * setting.cloud.median_spacing);
    EXPECT_LT(RmsBetween(parts.heights, whole.heights), 0.1 * scale) << noise;
    EXPECT_EQ(parts.measured + parts.smoothed + parts.filled, std::ssize(parts.heights));
    EXPECT_NEAR(static_cast<double>(parts.smoothed), static_cast<double>(whole.smoothed),
                0.05 * static_cast<double>(parts.heights.size()));
    EXPECT_EQ(parts.filled, 0);
    // Control points at a rim of a part have few points.
    EXPECT_NEAR(parts.noise_left, whole.noise_left, 0.2 * whole.noise_left);
  }
}

TEST(MeasureHeightsInPartsTest, ThreadsChangeNothing) {
  const Setting setting = Prepare(0.001);
  const DisplacementField one = InParts(setting, 12000, 1), four = InParts(setting, 12000, 4);
  EXPECT_EQ(one.heights, four.heights);
  EXPECT_EQ(one.source, four.source);
  EXPECT_EQ(one.noise_left, four.noise_left);
}

TEST(MeasureHeightsInPartsTest, AFaceOfItsOwnIsAPart) {
  const Setting setting = Prepare(0);
  const DisplacementField parts = InParts(setting, 1);
  EXPECT_LT(RmsBetween(parts.heights, Whole(setting).heights), 0.2 * setting.cloud.median_spacing);
}

TEST(MeasureHeightsInPartsTest, CanBeStopped) {
  const Setting setting = Prepare(0);
  RunContext context;
  std::stop_source stop;
  context.stop = stop.get_token();
  stop.request_stop();
  const PartCutter cutter = PartCutter::Make(setting.mesh).value();
  EXPECT_EQ(MeasureHeightsInParts(setting.cloud, setting.mesh, cutter, kLevel, 8000, {}, context)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
