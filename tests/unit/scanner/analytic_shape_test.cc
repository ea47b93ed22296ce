#include "tests/scans/analytic_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/scans/random.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

class ShapeTest : public testing::TestWithParam<std::string> {
 protected:
  ShapePtr shape_ = *MakeShape(GetParam());

  SimulatedScan Samples(int64_t count) const {
    ScannerOptions options;
    options.points = count;
    options.views = 0;
    return *SimulateScan(*shape_, options);
  }
  static bool HasSharpEdges() {
    return GetParam() == "cutbox" || GetParam() == "bracket" || GetParam() == "thinwalls";
  }
  Vector3d InEnlargedBox(Random* random) const {
    const Eigen::AlignedBox3d box = shape_->bounds();
    Vector3d unit;
    for (int axis = 0; axis < 3; ++axis) unit(axis) = random->Uniform(-0.8, 0.8);
    return box.center() + unit.cwiseProduct(box.sizes());
  }
};

TEST_P(ShapeTest, GradientMatchesDifferences) {
  const SimulatedScan scan = Samples(200);
  for (int i = 0; i < 200; ++i) {
    const Vector3d x = scan.cloud.points.col(i) + Vector3d(0.011, -0.007, 0.013);
    const Vector3d gradient = shape_->Gradient(x);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = 1e-6 * Vector3d::Unit(axis);
      const double slope = (shape_->Field(x + step) - shape_->Field(x - step)) / 2e-6;
      // Sharp edges kink the field between the two samples.
      if (HasSharpEdges()) continue;
      EXPECT_NEAR(gradient(axis), slope, 1e-6);
    }
  }
}

TEST_P(ShapeTest, StepAlongTheNormalIsTheDistance) {
  const SimulatedScan scan = Samples(300);
  for (int i = 0; i < 300; ++i) {
    const Vector3d p = scan.cloud.points.col(i), n = scan.normals.col(i);
    for (double step : {-0.004, 0.003, 0.02}) {
      const Vector3d x = p + step * n;
      // Near a sharp concave edge or the patch's border another point may be nearer, never farther.
      EXPECT_LE(std::abs(shape_->Distance(x)), std::abs(step) + 1e-10);
      if (HasSharpEdges()) continue;
      EXPECT_NEAR(shape_->Distance(x), step, 1e-10);
      EXPECT_LT((shape_->ClosestPoint(x) - p).norm(), 1e-9);
    }
  }
}

TEST_P(ShapeTest, NoSampleIsNearerThanTheClosestPoint) {
  const Eigen::Matrix3Xd samples = Samples(40000).cloud.points;
  Random random(7);
  for (int i = 0; i < 100; ++i) {
    const Vector3d x = InEnlargedBox(&random);
    const Vector3d closest = shape_->ClosestPoint(x);
    const double brute = std::sqrt((samples.colwise() - x).colwise().squaredNorm().minCoeff());
    EXPECT_LT(std::abs(shape_->Field(closest)), 1e-11);
    EXPECT_TRUE(shape_->Contains(closest));
    EXPECT_LE((closest - x).norm(), brute + 1e-11) << x.transpose();
    EXPECT_GT((closest - x).norm(), brute - 0.1);
  }
}

TEST_P(ShapeTest, SafeStepNeverPassesTheSurface) {
  Random random(11);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d x = InEnlargedBox(&random);
    EXPECT_LE(shape_->SafeStep(x, shape_->Field(x)), std::abs(shape_->Distance(x)) + 1e-12)
        << x.transpose();
    EXPECT_GE(shape_->SafeStep(x, shape_->Field(x)), 0.0);
  }
}

TEST_P(ShapeTest, BoundsEncloseTightly) {
  const Eigen::Matrix3Xd samples = Samples(40000).cloud.points;
  const Eigen::AlignedBox3d box = shape_->bounds();
  const Vector3d low = samples.rowwise().minCoeff(), high = samples.rowwise().maxCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GE(low(axis), box.min()(axis) - 1e-9);
    EXPECT_LE(high(axis), box.max()(axis) + 1e-9);
    EXPECT_LT(low(axis) - box.min()(axis), 0.05 * shape_->diagonal());
    EXPECT_LT(box.max()(axis) - high(axis), 0.05 * shape_->diagonal());
  }
}

// Euler number of the union of the closed cells whose centre lies inside: 1 - genus a component.
int SolidEulerNumber(const AnalyticShape& shape, int n) {
  const Eigen::AlignedBox3d box = shape.bounds();
  const double cell = 1.1 * box.sizes().maxCoeff() / n;
  const Vector3d origin = box.center() - Vector3d::Constant(0.5 * n * cell + 1e-4);
  std::vector<uint8_t> inside(static_cast<size_t>(n) * n * n);
  for (int z = 0, i = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x, ++i) {
        const Vector3d center = origin + cell * Vector3d(x + 0.5, y + 0.5, z + 0.5);
        inside[i] = shape.Field(center) < 0;
      }
    }
  }
  const auto filled = [&](int x, int y, int z) {
    if (x < 0 || y < 0 || z < 0 || x >= n || y >= n || z >= n) return false;
    return inside[(static_cast<size_t>(z) * n + y) * n + x] != 0;
  };
  // A face of dimension d spans (1 or 0) along each axis; it exists if a cell around it is filled.
  int euler = 0;
  for (int z = 0; z <= n; ++z) {
    for (int y = 0; y <= n; ++y) {
      for (int x = 0; x <= n; ++x) {
        for (int span = 0; span < 8; ++span) {
          bool exists = false;
          for (int back = 0; back < 8 && !exists; ++back) {
            if (back & span) continue;  // along a spanned axis there is but one cell
            exists = filled(x - (back & 1), y - (back >> 1 & 1), z - (back >> 2));
          }
          if (exists) euler += __builtin_popcount(span) % 2 ? -1 : 1;
        }
      }
    }
  }
  return euler;
}

TEST_P(ShapeTest, GenusIsThatOfTheSolid) {
  if (!shape_->closed()) GTEST_SKIP() << "an open patch bounds no solid";
  EXPECT_EQ(SolidEulerNumber(*shape_, 64), shape_->components() - shape_->genus());
}

INSTANTIATE_TEST_SUITE_P(All, ShapeTest, testing::ValuesIn(ShapeNames()),
                         [](const auto& param) { return param.param; });

TEST(MakeShapeTest, UnknownNameListsTheKnownOnes) {
  const auto shape = MakeShape("teapot");
  EXPECT_EQ(shape.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(shape.status().message()), testing::HasSubstr("teapot"));
  EXPECT_THAT(std::string(shape.status().message()), testing::HasSubstr("genus2"));
}

TEST(DistanceTest, KnownValues) {
  EXPECT_DOUBLE_EQ(MakeSphere(Vector3d(1, 0, 0), 2)->Distance(Vector3d(1, 5, 0)), 3);
  EXPECT_NEAR(MakeTorus(Vector3d::Zero(), 2, 0.5)->Distance(Vector3d(0, 0, 0)), 1.5, 1e-15);
  const ShapePtr box = MakeCutBox();
  EXPECT_NEAR(box->Distance(Vector3d(0, 0, 0)), 0.35, 1e-15);                     // in the hole
  EXPECT_NEAR(box->Distance(Vector3d(0.6, 0, 0)), -0.2, 1e-15);                   // in the material
  EXPECT_NEAR(box->Distance(Vector3d(0.8 + 3, 0, 0.4 + 4)), 5, 1e-14);            // from an edge
  EXPECT_NEAR(box->Distance(Vector3d(0, 0, 1.4)), std::hypot(1.0, 0.35), 1e-14);  // over the hole
}

}  // namespace
}  // namespace rilievo
