#include "core/displacement/continue_curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stop_token>
#include <vector>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using namespace testing;

constexpr double kRoundRadius = 0.4;

Vector3d PlaceOf(const Domain& domain, const DisplacementField& field, int v) {
  return domain.limit.positions.col(v) + double{field.heights[v]} * domain.limit.normals.col(v);
}

// Heights that reach the sphere, and none where `is_hole`.
DisplacementField OnSphere(const Domain& domain,
                           const std::function<bool(const Vector3d&)>& is_hole) {
  DisplacementField field;
  for (int v = 0; v < domain.size(); ++v) {
    const Vector3d place = domain.limit.positions.col(v);
    const double height = SphereHeight(place, domain.limit.normals.col(v), kRoundRadius);
    const bool hole = is_hole(place);
    field.heights.push_back(hole ? 0.0f : static_cast<float>(height));
    field.source.push_back(hole ? HeightSource::kFilled : HeightSource::kMeasured);
  }
  return field;
}

absl::Status Continue(const Domain& domain, DisplacementField* field,
                      const RunContext& context = RunContext()) {
  return ContinueCurvature(domain.refinement, domain.rings, domain.limit, DisplacementOptions(),
                           context, field);
}

struct ContinueCurvatureTest : ::testing::Test {
  Domain domain = MakeDomain(Octahedron(kRoundRadius, 2), 3);
  // Two holes, one of them a tenth of the sphere.
  DisplacementField field = OnSphere(domain, [](const Vector3d& x) {
    return x.z() > 0.8 * kRoundRadius || (x - Vector3d(0, 0, -kRoundRadius)).norm() < 0.1;
  });

  double Farthest() const {
    double farthest = 0;
    for (int v = 0; v < domain.size(); ++v) {
      farthest = std::max(farthest, std::abs(PlaceOf(domain, field, v).norm() - kRoundRadius));
    }
    return farthest;
  }
};

TEST_F(ContinueCurvatureTest, HolesOfASphereAreSpherical) {
  const DisplacementField before = field;
  EXPECT_GT(Farthest(), 3e-3);
  ASSERT_TRUE(Continue(domain, &field).ok());
  EXPECT_LT(Farthest(), 1e-5);
  for (int v = 0; v < domain.size(); ++v) {
    if (field.source[v] == HeightSource::kFilled) continue;
    EXPECT_EQ(field.heights[v], before.heights[v]) << v;
  }
}

// The first two are so near to each other that the second one sees what the first came to.
TEST_F(ContinueCurvatureTest, HolesSideBySideAreTheSameForAnyNumberOfThreads) {
  const auto holes = [](const Vector3d& x) {
    return (x - Vector3d(0, 0, kRoundRadius)).norm() < 0.06 ||
           (x - Vector3d(0, 0.16, 0.36)).norm() < 0.06 ||
           (x - Vector3d(kRoundRadius, 0, 0)).norm() < 0.06 ||
           (x - Vector3d(-kRoundRadius, 0, 0)).norm() < 0.06;
  };
  const DisplacementField before = OnSphere(domain, holes);
  DisplacementField one = before, many = before, stopped = before;
  ASSERT_TRUE(Continue(domain, &one, Threads(1)).ok());
  ASSERT_TRUE(Continue(domain, &many, Threads(4)).ok());
  EXPECT_NE(one.heights, before.heights);
  EXPECT_EQ(one.heights, many.heights);
  std::stop_source source;
  source.request_stop();
  RunContext context = Threads(2);
  context.stop = source.get_token();
  EXPECT_EQ(Continue(domain, &stopped, context).code(), absl::StatusCode::kCancelled);
}

TEST_F(ContinueCurvatureTest, ErrorsOfTheRimDoNotGrowInwards) {
  constexpr double kOff = 1e-4;
  Random random(1);
  for (int v = 0; v < domain.size(); ++v) {
    if (field.source[v] == HeightSource::kFilled) continue;
    field.heights[v] += static_cast<float>(Uniform(&random, -kOff, kOff));
  }
  ASSERT_TRUE(Continue(domain, &field).ok());
  EXPECT_LT(Farthest(), 3 * kOff);
}

TEST_F(ContinueCurvatureTest, PartsBesideABoundaryOrACreaseStay) {
  const Domain sheet = MakeDomain(Sheet(0.4, 4), 3);
  ControlMesh creased = Sheet(0.4, 4);
  creased.creases = {{11, 12, kInfiniteSharpness}, {12, 13, kInfiniteSharpness}};
  const Domain folded = MakeDomain(creased, 3);
  const auto changed = [](const Domain& on, double x, double y) {
    DisplacementField bumpy;
    for (int v = 0; v < on.size(); ++v) {
      const Vector3d place = on.limit.positions.col(v);
      const bool hole = std::hypot(place.x() - x, place.y() - y) < 0.06;
      bumpy.source.push_back(hole ? HeightSource::kFilled : HeightSource::kMeasured);
      bumpy.heights.push_back(hole ? 0.01f : 0.0f);
    }
    const std::vector<float> before = bumpy.heights;
    EXPECT_TRUE(Continue(on, &bumpy).ok());
    return bumpy.heights != before;
  };
  EXPECT_TRUE(changed(sheet, 0, 0));
  EXPECT_FALSE(changed(sheet, 0.35, 0));
  EXPECT_FALSE(changed(folded, 0, 0));
  EXPECT_TRUE(changed(folded, 0, 0.23));
}

}  // namespace
}  // namespace rilievo
