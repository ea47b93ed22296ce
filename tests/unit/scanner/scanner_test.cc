#include "tests/scans/scanner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scans/ray_cast.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

class ScanOfShapeTest : public testing::TestWithParam<std::string> {
 protected:
  ShapePtr shape_ = *MakeShape(GetParam());
};

TEST_P(ScanOfShapeTest, NoiseFreePointsLieOnTheSurface) {
  for (int views : {0, 1, 6}) {
    ScannerOptions options;
    options.points = 2000;
    options.views = views;
    const auto scan = SimulateScan(*shape_, options);
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_EQ(scan->cloud.points.cols(), 2000);
    EXPECT_EQ(scan->viewpoints.cols(), views);
    for (int i = 0; i < 2000; ++i) {
      const Vector3d p = scan->cloud.points.col(i);
      EXPECT_LT(std::abs(shape_->Field(p)), 1e-12);
      EXPECT_LT(std::abs(shape_->Distance(p)), 1e-9);
      EXPECT_NEAR(scan->normals.col(i).norm(), 1.0, 1e-12);
    }
  }
}

TEST_P(ScanOfShapeTest, EveryPointFacesItsViewpointAndIsNotHidden) {
  ScannerOptions options;
  options.points = 1500;
  options.views = 3;
  options.max_incidence_degrees = 90;
  const auto scan = SimulateScan(*shape_, options);
  ASSERT_TRUE(scan.ok());
  for (int i = 0; i < 1500; ++i) {
    const Vector3d p = scan->cloud.points.col(i);
    const Vector3d viewpoint = scan->viewpoints.col(scan->view[i]);
    EXPECT_GT(scan->normals.col(i).dot(viewpoint - p), 0);
    const double range = (viewpoint - p).norm();
    const Ray back{viewpoint, (p - viewpoint) / range};
    EXPECT_TRUE(RayCrossings(*shape_, back, range * (1 - 1e-6), 1).empty()) << p.transpose();
  }
}

TEST_P(ScanOfShapeTest, SeedDecidesEveryByte) {
  ScannerOptions options;
  options.points = 500;
  options.views = 4;
  options.noise = 0.001;
  options.outliers = 0.1;
  options.dropout = 0.3;
  const auto first = SimulateScan(*shape_, options), second = SimulateScan(*shape_, options);
  EXPECT_TRUE(first->cloud.points == second->cloud.points);
  options.seed = 2;
  EXPECT_FALSE(SimulateScan(*shape_, options)->cloud.points == first->cloud.points);
}

INSTANTIATE_TEST_SUITE_P(All, ScanOfShapeTest, testing::ValuesIn(ShapeNames()),
                         [](const auto& param) { return param.param; });

TEST(ScannerTest, NoiseLiesAlongTheRayWithTheAskedDeviation) {
  const ShapePtr shape = MakeSphere();
  ScannerOptions options;
  options.points = 20000;
  options.views = 5;
  options.noise = 0.002;
  const auto noisy = SimulateScan(*shape, options);
  options.noise = 0;
  const auto exact = SimulateScan(*shape, options);
  // Normal() draws from the same stream, so compare along the ray: the ray through a noisy point
  // still starts at its viewpoint, and its first crossing is the true point.
  double sum = 0, squares = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d viewpoint = noisy->viewpoints.col(noisy->view[i]);
    const Vector3d offset = noisy->cloud.points.col(i) - viewpoint;
    const Ray ray{viewpoint, offset.normalized()};
    const double hit = RayCrossings(*shape, ray, 10, 1).at(0);
    sum += offset.norm() - hit;
    squares += std::pow(offset.norm() - hit, 2);
  }
  const double sigma = 0.002 * shape->diagonal();
  EXPECT_NEAR(sum / 20000, 0, 4 * sigma / std::sqrt(20000));
  EXPECT_NEAR(std::sqrt(squares / 20000), sigma, 0.03 * sigma);
  EXPECT_EQ(exact->cloud.points.cols(), 20000);
}

TEST(ScannerTest, OutliersHaveTheAskedShareAndAreMarked) {
  ScannerOptions options;
  options.points = 10000;
  options.outliers = 0.05;
  const ShapePtr shape = MakeTorus();
  const auto scan = SimulateScan(*shape, options);
  EXPECT_EQ(scan->cloud.points.cols(), 10000);
  EXPECT_EQ(std::count(scan->outlier.begin(), scan->outlier.end(), 1), 500);
  for (int i = 0; i < 10000; ++i) {
    if (!scan->outlier[i]) {
      EXPECT_LT(std::abs(shape->Distance(scan->cloud.points.col(i))), 1e-9);
    }
    EXPECT_EQ(scan->view[i] == -1, scan->outlier[i] == 1);
  }
}

TEST(ScannerTest, WithoutViewsTheAreaIsSampledEvenly) {
  // Archimedes: z is uniform over a sphere, azimuth as well.
  ScannerOptions options;
  options.points = 40000;
  options.views = 0;
  const auto scan = SimulateScan(*MakeSphere(), options);
  std::vector<int> by_height(20), by_azimuth(20);
  for (int i = 0; i < 40000; ++i) {
    const Vector3d p = scan->cloud.points.col(i);
    ++by_height[std::clamp(static_cast<int>((p.z() + 1) * 10), 0, 19)];
    ++by_azimuth[std::clamp(static_cast<int>((std::atan2(p.y(), p.x()) / M_PI + 1) * 10), 0, 19)];
  }
  double chi_height = 0, chi_azimuth = 0;
  for (int bin = 0; bin < 20; ++bin) {
    chi_height += std::pow(by_height[bin] - 2000, 2) / 2000;
    chi_azimuth += std::pow(by_azimuth[bin] - 2000, 2) / 2000;
  }
  EXPECT_LT(chi_height, 45);  // 19 degrees of freedom: P(> 45) = 7e-4
  EXPECT_LT(chi_azimuth, 45);
}

TEST(ScannerTest, TorusAreaIsSharedBetweenInnerAndOuterHalf) {
  // Pappus: outer half 2 pi r (pi R + 2 r), inner 2 pi r (pi R - 2 r).
  const double ring = 0.7, tube = 0.28;
  ScannerOptions options;
  options.points = 40000;
  options.views = 0;
  const auto scan = SimulateScan(*MakeTorus(Vector3d::Zero(), ring, tube), options);
  int outer = 0;
  for (int i = 0; i < 40000; ++i) outer += scan->cloud.points.col(i).head<2>().norm() > ring;
  EXPECT_NEAR(outer / 40000.0, 0.5 + tube / (M_PI * ring), 0.01);
}

// Share of the returns nearer than `limit` from a viewpoint at distance d of the unit sphere's
// centre, by integration over the cone of rays: weight (nearest / range)^falloff a solid angle.
double NearShare(double d, double limit, double nearest, double falloff, double max_incidence) {
  double near = 0, all = 0;
  const double widest = std::asin(std::sin(max_incidence) / d);
  for (int k = 0; k < 100000; ++k) {
    const double angle = widest * (k + 0.5) / 100000;
    const double range = d * std::cos(angle) - std::sqrt(1 - std::pow(d * std::sin(angle), 2));
    const double weight = std::sin(angle) * std::pow(nearest / range, falloff);
    all += weight;
    if (range < limit) near += weight;
  }
  return near / all;
}

TEST(ScannerTest, DensityFallsWithDistance) {
  for (double falloff : {0.0, 3.0}) {
    ScannerOptions options;
    options.points = 60000;
    options.views = 1;
    options.view_distance = 1.3;
    options.falloff = falloff;
    const ShapePtr sphere = MakeSphere();
    const auto scan = SimulateScan(*sphere, options);
    const Vector3d viewpoint = scan->viewpoints.col(0);
    int near = 0;
    for (int i = 0; i < 60000; ++i) near += (scan->cloud.points.col(i) - viewpoint).norm() < 1.4;
    const double nearest = 0.3 * 0.5 * sphere->diagonal();
    const double expected = NearShare(viewpoint.norm(), 1.4, nearest, falloff,
                                      options.max_incidence_degrees * M_PI / 180);
    EXPECT_NEAR(near / 60000.0, expected, 0.01) << falloff;
  }
}

TEST(ScannerTest, OneViewSeesOneSide) {
  ScannerOptions options;
  options.points = 2000;
  options.views = 1;
  options.view_distance = 100;
  const auto scan = SimulateScan(*MakeSphere(), options);
  const Vector3d towards = scan->viewpoints.col(0).normalized();
  EXPECT_GT((towards.transpose() * scan->cloud.points).minCoeff(), 0.1);
}

TEST(ScannerTest, BadOptionsNameTheFieldAndItsRange) {
  ScannerOptions options;
  options.noise = -1;
  const auto status = SimulateScan(*MakeSphere(), options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("noise is -1"));
  options.noise = std::nan("");
  EXPECT_FALSE(SimulateScan(*MakeSphere(), options).ok());
  options.noise = 0;
  options.points = 0;
  EXPECT_FALSE(SimulateScan(*MakeSphere(), options).ok());
}

TEST(MeasureAgainstShapeTest, IsExactForOffsetPoints) {
  ScannerOptions options;
  options.points = 1000;
  options.views = 0;
  for (const char* name : {"star", "genus2", "terrain"}) {
    const ShapePtr shape = *MakeShape(name);
    const auto scan = SimulateScan(*shape, options);
    const Eigen::Matrix3Xd raised = scan->cloud.points + 0.003 * scan->normals;
    const ShapeError error = MeasureAgainstShape(*shape, raised);
    EXPECT_NEAR(error.rms, 0.003, 1e-9) << name;
    EXPECT_NEAR(error.mean, 0.003, 1e-9);
    EXPECT_NEAR(error.max, 0.003, 1e-9);
  }
}

}  // namespace
}  // namespace rilievo
