#include "core/points/edge_model/two_plane_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/scans/random.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kPoints = 4000;

// The edge along y at the origin, its faces as flat as the mesh may show them.
EdgePlace PlaceAtOrigin(double off = 0) {
  EdgePlace place;
  place.middle = {off, 0, 0};
  place.along = Vector3d::UnitY();
  const double slope = 0.3;
  place.normal = {Vector3d(-slope, 0, 1).normalized(), Vector3d(slope, 0, 1).normalized()};
  place.inward = {-Vector3d::UnitX(), Vector3d::UnitX()};
  return place;
}

// Points of the roof |x| < 0.5, |y| < 0.5 whose sides fall by `slope` from the ridge along y,
// rounded to an arc of the given radius.
OrientedCloud Roof(double slope, double noise, double radius = 0) {
  Random random(7);
  const double area = std::hypot(1.0, slope);
  return CloudOf(kPoints, area, [&] {
    const double x = random.Uniform(-0.5, 0.5), y = random.Uniform(-0.5, 0.5);
    Vector3d normal = Vector3d(x < 0 ? -slope : slope, 0, 1).normalized();
    Vector3d at(x, y, -slope * std::abs(x));
    if (std::abs(x) < radius * slope / area) {
      normal = Vector3d(x, 0, std::sqrt(radius * radius - x * x)) / radius;
      at.z() = radius * (normal.z() - area);
    }
    return std::pair<Vector3d, Vector3d>(at + noise * random.Normal() * normal, normal);
  });
}

TEST(TwoPlaneModelTest, FindsTheRidgeOfARoof) {
  for (double slope : {0.3, 0.6, 1.0, 2.0}) {
    const OrientedCloud cloud = Roof(slope, 0);
    const PointIndex index(cloud.points);
    // The edge half a spacing aside of the ridge.
    const auto fit = FitTwoPlaneModel(cloud, index, PlaceAtOrigin(cloud.median_spacing / 2));
    ASSERT_TRUE(fit.has_value()) << slope;
    EXPECT_GT(fit->log_likelihood_ratio, 20) << slope;
    EXPECT_NEAR(fit->cosine, std::cos(2 * std::atan(slope)), 1e-6) << slope;
    EXPECT_NEAR(fit->at.x(), 0, 1e-9) << slope;
    EXPECT_NEAR(fit->at.z(), 0, 1e-9) << slope;
    EXPECT_NEAR(std::abs(fit->direction.y()), 1, 1e-9) << slope;
    for (const HingePlane& side : fit->sides) {
      EXPECT_NEAR(side.normal.dot(Vector3d(0, 0.2, 0)), side.offset, 1e-9);
      EXPECT_GT(side.normal.z(), 0);
    }
  }
}

TEST(TwoPlaneModelTest, FindsTheRidgeUnderNoise) {
  OrientedCloud cloud = Roof(1.0, 0);
  const double noise = 0.3 * cloud.median_spacing;
  cloud = Roof(1.0, noise);
  cloud.noise.assign(cloud.noise.size(), static_cast<float>(noise));
  const PointIndex index(cloud.points);
  double log_likelihood_ratio = 0;
  int count = 0;
  for (double y = -0.35; y <= 0.35; y += 0.05, ++count) {
    EdgePlace place = PlaceAtOrigin();
    place.middle.y() = y;
    const auto fit = FitTwoPlaneModel(cloud, index, place);
    ASSERT_TRUE(fit.has_value());
    log_likelihood_ratio += fit->log_likelihood_ratio;
    EXPECT_NEAR(fit->at.x(), 0, cloud.median_spacing / 2);
    EXPECT_NEAR(fit->at.z(), 0, cloud.median_spacing / 2);
    EXPECT_GT(std::abs(fit->direction.y()), 0.97);
  }
  // One place may say little, the run of them says enough.
  EXPECT_GT(log_likelihood_ratio / count, 16);
}

TEST(TwoPlaneModelTest, RoundedRidgesAreBluntAndSharpOnesAreNot) {
  const double spacing = Roof(1.0, 0).median_spacing;
  const double noise = 0.3 * spacing;
  for (const double radius : {0.0, 2 * spacing}) {
    OrientedCloud cloud = Roof(1.0, noise, radius);
    cloud.noise.assign(cloud.noise.size(), static_cast<float>(noise));
    const PointIndex index(cloud.points);
    int blunt = 0, count = 0;
    for (double y = -0.35; y <= 0.35; y += 0.05, ++count) {
      EdgePlace place = PlaceAtOrigin();
      place.middle.y() = y;
      const auto fit = FitTwoPlaneModel(cloud, index, place);
      ASSERT_TRUE(fit.has_value());
      blunt += fit->bluntness > 1.5;
    }
    if (radius > 0) {
      EXPECT_GT(2 * blunt, count);
    } else {
      EXPECT_EQ(blunt, 0);
    }
  }
}

TEST(TwoPlaneModelTest, BentSurfacesAreBetterExplainedByAQuadric) {
  // Cylinders that turn by up to 60 degrees within the points looked at.
  const double spacing = std::sqrt(4 / (std::numbers::pi * kPoints));
  for (double radius : {7 * spacing, 12 * spacing, 30 * spacing}) {
    Random random(11);
    const double half_turn = std::min(std::numbers::pi, 0.5 / radius);
    const OrientedCloud cloud = CloudOf(kPoints, 2 * half_turn * radius, [&] {
      const double turn = random.Uniform(-half_turn, half_turn);
      const Vector3d normal(std::sin(turn), 0, std::cos(turn));
      const Vector3d at = radius * (normal - Vector3d::UnitZ());
      return std::pair<Vector3d, Vector3d>(at + Vector3d(0, random.Uniform(-0.5, 0.5), 0), normal);
    });
    const PointIndex index(cloud.points);
    const auto fit = FitTwoPlaneModel(cloud, index, PlaceAtOrigin());
    EXPECT_LT(fit ? fit->log_likelihood_ratio : 0, 8) << radius / spacing;
  }
}

TEST(TwoPlaneModelTest, TheRimOfAHoleIsACrease) {
  // A hole of five spacings' radius through a plate: its wall bends along the rim.
  const double spacing = std::sqrt(4 / (std::numbers::pi * kPoints)), radius = 5 * spacing;
  Random random(5);
  const double wall = 2 * std::numbers::pi * radius * 0.5;
  const OrientedCloud cloud = CloudOf(kPoints, 1, [&]() -> std::pair<Vector3d, Vector3d> {
    if (random.Uniform(0, 1) < wall) {
      const double turn = random.Uniform(-std::numbers::pi, std::numbers::pi);
      const Vector3d out(std::cos(turn), std::sin(turn), 0);
      return {radius * out - random.Uniform(0, 0.5) * Vector3d::UnitZ(), -out};
    }
    for (;;) {
      const Vector3d at(random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5), 0);
      if (at.norm() > radius) return {at, Vector3d::UnitZ()};
    }
  });
  const PointIndex index(cloud.points);
  EdgePlace place;
  place.middle = {radius, 0, 0};
  place.along = Vector3d::UnitY();
  place.normal = {Vector3d(-1, 0, 0.5).normalized(), Vector3d(-0.5, 0, 1).normalized()};
  place.inward = {-Vector3d::UnitZ(), Vector3d::UnitX()};
  const auto fit = FitTwoPlaneModel(cloud, index, place);
  ASSERT_TRUE(fit.has_value());
  EXPECT_GT(fit->log_likelihood_ratio, 20);
  EXPECT_NEAR(fit->cosine, 0, 0.05);
  EXPECT_NEAR((fit->at - place.middle).norm(), 0, 0.2 * spacing);
  // The rim two spacings on: the wall has turned, the plate has not.
  const double turn = 2 * spacing / radius;
  const Vector3d on = radius * Vector3d(std::cos(turn), std::sin(turn), 0);
  const HingePlane turned = fit->TangentAt(0, on), level = fit->TangentAt(1, on);
  EXPECT_GT(turned.normal.dot(-on / radius), 0.99);
  EXPECT_NEAR(turned.normal.dot(on), turned.offset, 0.3 * spacing);
  EXPECT_GT(level.normal.z(), 0.99);
}

TEST(TwoPlaneModelTest, OneSideAloneIsNothing) {
  const OrientedCloud cloud = Roof(1.0, 0);
  const PointIndex index(cloud.points);
  EdgePlace place = PlaceAtOrigin();
  place.normal = {Vector3d(-1, 0, -0.2).normalized(), Vector3d(-1, 0, -0.2).normalized()};
  EXPECT_FALSE(FitTwoPlaneModel(cloud, index, place).has_value());
}

TEST(TwoPlaneModelTest, TheThirdSideOfACornerHidesNoEdge) {
  const Vector3d half(0.3, 0.3, 0.3);
  const OrientedCloud cloud = BoxCloud(half, 20'000);
  const PointIndex index(cloud.points);
  EdgePlace place;
  place.middle = half - Vector3d(0, 1.5 * cloud.median_spacing, 0);
  place.along = Vector3d::UnitY();
  place.normal = {Vector3d(1, 0, 0.5).normalized(), Vector3d(0.5, 0, 1).normalized()};
  place.inward = {-Vector3d::UnitZ(), -Vector3d::UnitX()};
  const auto fit = FitTwoPlaneModel(cloud, index, place);
  ASSERT_TRUE(fit.has_value());
  EXPECT_GT(fit->log_likelihood_ratio, 20);
  EXPECT_NEAR(std::abs(fit->direction.y()), 1, 1e-9);
  EXPECT_NEAR((fit->at - place.middle).norm(), 0, 1e-9);
}

}  // namespace
}  // namespace rilievo
