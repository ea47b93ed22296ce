#include "core/pipeline/color_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

Rgb ColorAt(const Eigen::Vector3d& p) {
  const auto wave = [](double x) {
    return static_cast<uint8_t>(std::lround(128 + 90 * std::sin(x)));
  };
  return {wave(2 * p[0]), wave(3 * p[1] + 1), wave(2 * p[2] + 2)};
}

// A torus; among its points are some far away, which are removed, and one that is not finite.
PointCloud ColoredScan() {
  ScannerOptions options;
  options.points = 8000;
  options.views = 0;
  PointCloud scan = SimulateScan(*MakeTorus(), options).value().cloud;
  for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
    scan.sights.colors.push_back(ColorAt(scan.points.col(i)));
  }
  for (const int i : {7, 1000, 4321}) {
    scan.points.col(i) *= 1.9;
    scan.sights.colors[static_cast<size_t>(i)] = {0, 255, 0};
  }
  scan.points(1, 2222) = std::nan("");
  return scan;
}

TEST(ColorSurfaceTest, ColoursStayWithTheirPointsToTheFile) {
  const PointCloud scan = ColoredScan();
  const auto result = Reconstruct(scan, ReconstructOptions{}, RunContext{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_GT(result->report.outliers + result->report.island_points, 0);
  EXPECT_GT(result->report.color_bytes, 0);
  EXPECT_LE(result->report.color_rms, kColorError);
  const DecodedSurface decoded = DecodeDss(result->encoded.Concatenate(), RunContext{}).value();
  EXPECT_EQ(decoded.metadata.scan_points, 8000);
  const TriangleMesh mesh =
      Tessellate(decoded.surface, decoded.surface.max_level, RunContext{}).value();
  double sum = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Rgb expected = ColorAt(mesh.vertices.col(v));
    for (size_t k = 0; k < 3; ++k) {
      sum += std::pow((expected[k] - decoded.surface.colors[static_cast<size_t>(v)][k]) / 255.0, 2);
    }
  }
  EXPECT_LT(std::sqrt(sum / (3 * static_cast<double>(mesh.vertices.cols()))), 1.2 * kColorError);
}

TEST(ColorSurfaceTest, TheShapeIsThatOfTheScanWithoutThem) {
  PointCloud scan = ColoredScan();
  const auto colored = Reconstruct(scan, ReconstructOptions{}, RunContext{});
  scan.sights.colors.clear();
  const auto plain = Reconstruct(scan, ReconstructOptions{}, RunContext{});
  ASSERT_TRUE(colored.ok() && plain.ok());
  EXPECT_EQ(colored->surface.heights, plain->surface.heights);
  EXPECT_EQ(plain->report.color_bytes, 0);
  EXPECT_EQ(colored->report.error.rms, plain->report.error.rms);
}

TEST(ColorSurfaceTest, TheBytesAskedForHoldShapeAndColours) {
  ReconstructOptions options;
  options.encode.max_bytes = 2500;
  const auto result = Reconstruct(ColoredScan(), options, RunContext{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_LE(BytesOf(result->encoded), 2500);
  EXPECT_GT(result->report.color_bytes, 0);
  EXPECT_LT(result->report.color_bytes, 2500 / 4);
  // What colours leave of their third is not lost.
  EXPECT_GT(BytesOf(result->encoded), 2500 * 95 / 100);
  const DecodedSurface decoded = DecodeDss(result->encoded.Concatenate(), RunContext{}).value();
  EXPECT_NE(decoded.metadata.options.find("max_bytes=2500"), std::string::npos);
}

}  // namespace
}  // namespace rilievo
