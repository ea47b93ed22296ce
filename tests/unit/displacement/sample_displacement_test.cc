#include "core/displacement/sample_displacement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr double kRadius = 0.3;

// Flat triangles fitted to a sphere lie on both sides of it, their corners outside.
TEST(SampleDisplacementTest, SphereOverASmallerDomainIsExactToTheSecondOrderOfTheEdges) {
  const Scan scan = SphereScan(kRadius, 40000);
  for (const int level : {2, 3, 4}) {
    const Domain domain = MakeDomain(Octahedron(0.29, 2), level);
    const DisplacementField field = Sample(scan, domain);
    EXPECT_EQ(field.filled, 0);
    const HeightError error = Compare(field, [&](int v) {
      return SphereHeight(domain.limit.positions.col(v), domain.limit.normals.col(v), kRadius);
    });
    // The height of a spherical segment over the mean triangle.
    const double triangle = 4 * M_PI * kRadius * kRadius / (128 << (2 * level));
    const double segment = triangle * 4 / std::sqrt(3.0) / (8 * kRadius);
    EXPECT_LT(error.rms, 1.1 * segment) << level;
    EXPECT_LT(error.max, 2 * segment) << level;
  }
}

TEST(SampleDisplacementTest, WavySphereFollowsTheWaves) {
  constexpr int kCount = 40000;
  const auto radius_at = [](const Eigen::Vector3d& d) {
    return kRadius + 0.01 * std::sin(12 * d[0]) * std::sin(12 * d[1]) * std::sin(12 * d[2]);
  };
  Points points;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3d d = SpiralDirection(i, kCount);
    const Eigen::Vector3d u = d.unitOrthogonal(), v = d.cross(u);
    const auto at = [&](double a, double b) {
      const Eigen::Vector3d moved = (d + a * u + b * v).normalized();
      return Eigen::Vector3d(moved * radius_at(moved));
    };
    points.Add(at(0, 0), (at(1e-5, 0) - at(-1e-5, 0)).cross(at(0, 1e-5) - at(0, -1e-5)));
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const Domain domain = MakeDomain(Octahedron(kRadius, 2), 4);
  const DisplacementField field = Sample(scan, domain);
  EXPECT_EQ(field.filled, 0);
  // The distance of each sampled point from the waves, along the radius.
  double worst = 0;
  for (int v = 0; v < domain.size(); ++v) {
    const Eigen::Vector3d p =
        domain.limit.positions.col(v) + field.heights[v] * domain.limit.normals.col(v);
    worst = std::max(worst, std::abs(p.norm() - radius_at(p.normalized())));
  }
  EXPECT_LT(worst, 0.1 * scan.cloud.median_spacing);
}

TEST(SampleDisplacementTest, SineReliefOverAPlane) {
  Random random(1);
  const auto height_field = [](double x, double y) {
    return 0.01 * std::sin(30 * x) * std::cos(25 * y);
  };
  const Points points = HeightFieldPoints(0.35, 22500, &random, height_field);
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const Domain domain = MakeDomain(Sheet(0.33, 8), 4);
  const DisplacementField field = Sample(scan, domain);
  EXPECT_EQ(field.filled, 0);
  const HeightError error = Compare(field, [&](int v) {
    return height_field(domain.limit.positions(0, v), domain.limit.positions(1, v));
  });
  EXPECT_LT(error.rms, 0.02 * scan.cloud.median_spacing);
  EXPECT_LT(error.max, 0.2 * scan.cloud.median_spacing);
}

class NoisySheetTest : public ::testing::TestWithParam<double> {};

TEST_P(NoisySheetTest, NoiseIsAveragedAway) {
  Random random(2);
  Points points = HeightFieldPoints(0.35, 22500, &random, [](double, double) { return 0.0; });
  const double sigma = GetParam() * 0.7 / 150 * 2 / std::sqrt(M_PI);  // times the spacing
  for (Eigen::Vector3d& p : points.at) p[2] += sigma * Gauss(&random);
  const Scan scan = MakeScan(points.Positions(), points.Normals(), sigma);
  const Domain domain = MakeDomain(Sheet(0.3, 8), 4);
  const DisplacementField field = Sample(scan, domain);
  EXPECT_LT(Compare(field, [](int) { return 0.0; }).rms, 0.3 * sigma);
}

INSTANTIATE_TEST_SUITE_P(NoiseOverSpacing, NoisySheetTest, ::testing::Values(0.25, 0.5, 1.0));

TEST(SampleDisplacementTest, TwoSheetsOfAThinWallKeepTheirOwn) {
  Random random(3);
  Points points = HeightFieldPoints(0.35, 22500, &random, [](double, double) { return 0.0; });
  const double thickness = 0.004;  // below the spacing of 0.0053
  const Points back = HeightFieldPoints(0.35, 22500, &random, [](double, double) { return 0.0; });
  for (size_t i = 0; i < back.at.size(); ++i) {
    points.Add(back.at[i] - Eigen::Vector3d(0, 0, thickness), -back.normal[i]);
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  for (const double z : {0.001, -0.001, -0.003}) {
    const Domain front = MakeDomain(Sheet(0.3, 8, z), 3);
    const DisplacementField field = Sample(scan, front);
    EXPECT_EQ(field.filled, 0);
    EXPECT_LT(Compare(field, [&](int) { return -z; }).max, 1e-6);

    ControlMesh reversed = Sheet(0.3, 8, z);
    reversed.faces.row(1).swap(reversed.faces.row(2));
    const Domain behind = MakeDomain(reversed, 3);
    const DisplacementField other = Sample(scan, behind);
    EXPECT_EQ(other.filled, 0);
    EXPECT_LT(Compare(other, [&](int) { return thickness + z; }).max, 1e-6);
  }
}

TEST(SampleDisplacementTest, OfNestedShellsTheNearerIsSampled) {
  Points points = SpherePoints(kRadius, 20000);
  const Points inner = SpherePoints(kRadius - 0.03, 20000);
  for (size_t i = 0; i < inner.at.size(); ++i) points.Add(inner.at[i], inner.normal[i]);
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  for (const double start : {0.297, 0.274}) {
    const Domain domain = MakeDomain(Octahedron(start, 3), 2);
    const DisplacementField field = Sample(scan, domain);
    EXPECT_EQ(field.filled, 0);
    const double expected = start > 0.29 ? kRadius : kRadius - 0.03;
    const HeightError error = Compare(field, [&](int v) {
      return SphereHeight(domain.limit.positions.col(v), domain.limit.normals.col(v), expected);
    });
    EXPECT_LT(error.max, 0.02 * 0.03);  // of the distance between the shells
  }
}

TEST(SampleDisplacementTest, AMissingCapIsMarkedAndFilledSmoothly) {
  constexpr double kCap = 0.9;  // z / radius above which nothing was scanned: 26 degrees
  Points all = SpherePoints(kRadius, 20000), points;
  for (size_t i = 0; i < all.at.size(); ++i) {
    if (all.normal[i][2] < kCap) points.Add(all.at[i], all.normal[i]);
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const Domain domain = MakeDomain(Octahedron(0.29, 2), 3);
  const DisplacementField field = Sample(scan, domain);
  const double spacing = scan.cloud.median_spacing;
  for (int v = 0; v < domain.size(); ++v) {
    const double truth =
        SphereHeight(domain.limit.positions.col(v), domain.limit.normals.col(v), kRadius);
    const Eigen::Vector3d hit = domain.limit.positions.col(v) + truth * domain.limit.normals.col(v);
    const double beyond = hit[2] - kCap * kRadius;
    if (std::abs(beyond) > 2 * spacing) {
      EXPECT_EQ(field.source[v] == HeightSource::kFilled, beyond > 0) << v;
    }
    // The true height is about 0.01 all over: the fill keeps to it to a third.
    EXPECT_NEAR(field.heights[v], truth, 0.0035) << v;
  }
  // No step at the rim: neighbours differ by no more than inside the fill.
  const MeshTopology& finest = domain.refinement.levels.back();
  for (const auto& edge : finest.edge_vertices.colwise()) {
    EXPECT_LT(std::abs(field.heights[edge[0]] - field.heights[edge[1]]), 0.0012);
  }
  EXPECT_EQ(field.measured + field.smoothed + field.filled, domain.size());
}

TEST(SampleDisplacementTest, WithoutAnyDataAllIsFilledWithZero) {
  const Scan scan = SphereScan(kRadius, 2000);
  ControlMesh far = Octahedron(0.05, 1);  // beyond max_height of the cloud everywhere
  const Domain domain = MakeDomain(far, 2);
  const DisplacementField field = Sample(scan, domain);
  EXPECT_EQ(field.filled, domain.size());
  EXPECT_THAT(field.heights, ::testing::Each(0.0f));
  EXPECT_THAT(field.source, ::testing::Each(HeightSource::kFilled));
}

// A roof of two planes that meet at 90 degrees along the y axis.
TEST(SampleDisplacementTest, ASharpEdgeIsNotRounded) {
  Random random(4);
  const auto roof = [](double x, double) { return 0.02 - std::abs(x); };
  const Points points = HeightFieldPoints(0.2, 14400, &random, roof);
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const Domain domain = MakeDomain(Sheet(0.15, 8), 4);
  DisplacementOptions options;
  options.max_height = 0.2;
  const DisplacementField field = Sample(scan, domain, options);
  const auto truth = [&](int v) { return roof(domain.limit.positions(0, v), 0); };
  EXPECT_LT(Compare(field, truth).max, 0.75 * scan.cloud.median_spacing);
  EXPECT_LT(Compare(field, truth).rms, 0.04 * scan.cloud.median_spacing);
}

TEST(SampleDisplacementTest, ANoisySharpEdgeStaysWithinHalfASpacing) {
  Random random(5);
  const auto roof = [](double x, double) { return 0.02 - std::abs(x); };
  Points points = HeightFieldPoints(0.2, 14400, &random, roof);
  const double sigma = 0.001;  // about a quarter of the spacing
  for (size_t i = 0; i < points.at.size(); ++i) {
    points.at[i] += sigma * Gauss(&random) * points.normal[i];
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), sigma);
  const Domain domain = MakeDomain(Sheet(0.15, 8), 4);
  DisplacementOptions options;
  options.max_height = 0.2;
  const DisplacementField field = Sample(scan, domain, options);
  const auto truth = [&](int v) { return roof(domain.limit.positions(0, v), 0); };
  const auto near_edge = [&](int v) { return std::abs(domain.limit.positions(0, v)) < 0.004; };
  EXPECT_LT(Compare(field, truth, near_edge).rms, 0.5 * scan.cloud.median_spacing);
  EXPECT_LT(Compare(field, truth).rms, 0.7 * sigma);
}

TEST(SampleDisplacementTest, OutliersMakeNoSpikes) {
  Points points = SpherePoints(kRadius, 20000);
  Random random(6);
  for (int i = 0; i < 400; ++i) {  // off the surface by 1 to 4 spacings, normals as around them
    const Eigen::Vector3d direction = SpiralDirection(i, 400);
    points.Add((kRadius + Uniform(&random, 0.01, 0.04)) * direction, direction);
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const Domain domain = MakeDomain(Octahedron(0.295, 2), 4);
  const DisplacementField field = Sample(scan, domain);
  const HeightError error = Compare(field, [&](int v) {
    return SphereHeight(domain.limit.positions.col(v), domain.limit.normals.col(v), kRadius);
  });
  EXPECT_LT(error.max, 0.5 * scan.cloud.median_spacing);
}

// Left half clean, right half noisy, a hole in the middle.
TEST(SampleDisplacementTest, EachHeightSaysWhereItComesFrom) {
  Random random(21);
  const Points even = HeightFieldPoints(0.3, 10000, &random, [](double x, double y) {
    return x > 0 ? 0.01 : 0.01 + 0.003 * std::sin(150 * x) * std::sin(150 * y);
  });
  constexpr double kNoise = 0.004;  // two thirds of the spacing
  Points points;
  for (size_t i = 0; i < even.at.size(); ++i) {
    if (even.at[i].head<2>().norm() < 0.06) continue;
    points.Add(even.at[i], even.normal[i]);
    if (even.at[i].x() > 0) points.at.back().z() += kNoise * Gauss(&random);
  }
  Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  for (size_t i = 0; i < points.at.size(); ++i) {
    scan.cloud.noise[i] = points.at[i].x() > 0 ? static_cast<float>(kNoise) : 0.0f;
  }
  const Domain domain = MakeDomain(Sheet(0.25, 8), 4);
  const DisplacementField field = Sample(scan, domain);
  std::array<int, 3> count{};
  int far = 0, as_expected = 0;
  for (int v = 0; v < domain.size(); ++v) {
    const double x = domain.limit.positions(0, v);
    const double radius = domain.limit.positions.col(v).head<2>().norm();
    ++count[static_cast<int>(field.source[v])];
    if (radius < 0.05) {
      EXPECT_EQ(field.source[v], HeightSource::kFilled);
    } else if (radius > 0.07 && std::abs(x) > 0.1) {
      ++far;
      as_expected += field.source[v] == (x > 0 ? HeightSource::kSmoothed : HeightSource::kMeasured);
    }
  }
  EXPECT_GT(as_expected, 0.9 * far) << far;
  EXPECT_EQ(count[0], field.measured);
  EXPECT_EQ(count[1], field.smoothed);
  EXPECT_EQ(count[2], field.filled);
}

}  // namespace
}  // namespace rilievo
