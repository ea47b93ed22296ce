#include "core/displacement/sample_colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr double kPaintedRadius = 0.3;

using Paint = std::function<Rgb(const Eigen::Vector3d& direction)>;

uint8_t Byte(double value) { return static_cast<uint8_t>(std::lround(value)); }

Rgb Gradient(const Eigen::Vector3d& d) {
  return {Byte(128 + 100 * d[0]), Byte(128 + 100 * std::sin(3 * d[1])), Byte(128 - 90 * d[2])};
}

// Waves of 12 edges of the finest level used here.
Rgb Waves(const Eigen::Vector3d& d) {
  const double wave = std::sin(26 * d[0]);
  return {Byte(128 + 100 * wave), Byte(128 - 80 * wave), 60};
}

std::vector<Rgb> Painted(const Scan& scan, const Paint& paint) {
  std::vector<Rgb> colors;
  for (const auto& p : scan.cloud.points.colwise()) colors.push_back(paint(p.normalized()));
  return colors;
}

std::vector<Rgb> Sampled(const Scan& scan, const std::vector<Rgb>& colors, const Domain& domain,
                         int threads = 2) {
  return SampleColors(scan.cloud, colors, domain.refinement, domain.rings, domain.limit,
                      DisplacementOptions(), Threads(threads))
      .value();
}

// RMS of the channels, of 255, over the vertices that `counts` accepts.
double Rms(const std::vector<Rgb>& colors, const Domain& domain, const Paint& paint,
           const std::function<bool(const Eigen::Vector3d&)>& counts) {
  double sum = 0, count = 0;
  for (int v = 0; v < domain.size(); ++v) {
    const Eigen::Vector3d d = domain.limit.positions.col(v).normalized();
    if (!counts(d)) continue;
    for (size_t k = 0; k < 3; ++k) sum += std::pow(colors[v][k] - double{paint(d)[k] * 1.0}, 2);
    count += 3;
  }
  return std::sqrt(sum / count);
}

bool All(const Eigen::Vector3d& /*d*/) { return true; }

TEST(SampleColorsTest, ColoursOfThePointsComeToTheVertices) {
  const Scan scan = SphereScan(kPaintedRadius, 40000);
  const Domain domain = MakeDomain(Octahedron(0.29, 2), 4);
  EXPECT_LT(Rms(Sampled(scan, Painted(scan, Gradient), domain), domain, Gradient, All), 0.6);
  EXPECT_LT(Rms(Sampled(scan, Painted(scan, Waves), domain), domain, Waves, All), 4);
}

TEST(SampleColorsTest, WrongColoursOfAFewPointsHardlyShow) {
  const Scan scan = SphereScan(kPaintedRadius, 160000);
  const Domain domain = MakeDomain(Octahedron(0.29, 2), 4);
  std::vector<Rgb> colors = Painted(scan, Gradient);
  Random random(3);
  for (Rgb& color : colors) {
    if (Uniform(&random, 0, 1) < 0.05) color = {255, 0, 255};
  }
  const std::vector<Rgb> sampled = Sampled(scan, colors, domain);
  // A mean of all would be off by 5 % of some 130.
  EXPECT_LT(Rms(sampled, domain, Gradient, All), 2.5);
}

TEST(SampleColorsTest, WhereNoPointsAreColoursGoOver) {
  const Scan whole = SphereScan(kPaintedRadius, 40000);
  Points points;
  for (const auto& p : whole.cloud.points.colwise()) {
    if (p[2] < 0.2) points.Add(p, p);
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const Domain domain = MakeDomain(Octahedron(0.29, 1), 5);
  const Paint half = [](const Eigen::Vector3d& d) {
    return d[0] > 0 ? Rgb{200, 100, 50} : Rgb{100, 150, 200};
  };
  const std::vector<Rgb> sampled = Sampled(scan, Painted(scan, half), domain);
  const auto in_hole = [](const Eigen::Vector3d& d) { return d[2] > 0.75; };
  for (int v = 0; v < domain.size(); ++v) {
    if (!in_hole(domain.limit.positions.col(v).normalized())) continue;
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GE(sampled[v][k], std::min(half({1, 0, 0})[k], half({-1, 0, 0})[k]) - 1);
      EXPECT_LE(sampled[v][k], std::max(half({1, 0, 0})[k], half({-1, 0, 0})[k]) + 1);
    }
  }
  const MeshTopology& finest = domain.refinement.levels.back();
  for (int e = 0; e < finest.edge_count(); ++e) {
    const int a = finest.edge_vertices(0, e), b = finest.edge_vertices(1, e);
    if (!in_hole(domain.limit.positions.col(a).normalized())) continue;
    EXPECT_LT(std::abs(sampled[a][0] - sampled[b][0]), 40) << "a step within the hole";
  }
}

TEST(SampleColorsTest, TheSameForAnyNumberOfThreadsAndOnACoarsestLevelAlone) {
  const Scan scan = SphereScan(kPaintedRadius, 20000);
  const std::vector<Rgb> colors = Painted(scan, Waves);
  const Domain domain = MakeDomain(Octahedron(0.29, 2), 3),
               coarse = MakeDomain(Octahedron(0.29, 4), 0);
  EXPECT_EQ(Sampled(scan, colors, domain, 1), Sampled(scan, colors, domain, 3));
  EXPECT_LT(Rms(Sampled(scan, Painted(scan, Gradient), coarse), coarse, Gradient, All), 2);
}

}  // namespace
}  // namespace rilievo
