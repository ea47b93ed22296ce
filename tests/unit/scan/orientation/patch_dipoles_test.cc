#include "core/scan/orientation/patch_dipoles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stop_token>
#include <vector>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

// Points with their true normals, in two patches: those that `second` takes and the others.
struct TwoPatches {
  OrientedCloud cloud;
  OrientationPatches patches;

  template <typename IsSecond>
  TwoPatches(const KnownCloud& known, double area, IsSecond second) {
    cloud.points = known.cloud.points;
    cloud.normals = known.normals;
    const auto count = static_cast<size_t>(cloud.points.cols());
    const double spacing = std::sqrt(4 * area / (M_PI * static_cast<double>(count)));
    cloud.spacing.assign(count, static_cast<float>(spacing));
    cloud.noise.assign(count, 0.0f);
    for (const auto point : cloud.points.colwise()) patches.patch.push_back(second(point) ? 1 : 0);
    patches.parity.assign(count, 0);
    patches.count = 2;
  }

  std::optional<double> Relation(double balance, int sign = 1) const {
    const SignedNode a{0, 1}, b{1, sign};
    const PatchDipoles dipoles(patches, cloud);
    const std::optional<double> relation = dipoles.Relation(balance, {&a, 1}, {&b, 1}, {}).value();
    const std::optional<double> other = dipoles.Relation(balance, {&b, 1}, {&a, 1}, {}).value();
    EXPECT_EQ(relation.has_value(), other.has_value());
    EXPECT_NEAR(relation.value_or(0), other.value_or(0), 1e-9);
    return relation;
  }

  double Agreement(int sign = 1) const { return Relation(0, sign).value(); }
};

bool AtTheTop(const Eigen::Vector3d& at) { return at.z() > 0.8; }

TEST(PatchDipolesTest, ACapAgreesWithTheRestOfItsSphere) {
  TwoPatches sphere(SphereCloud(4000, 1), 4 * M_PI, AtTheTop);
  EXPECT_GT(sphere.Agreement(), 2);
  EXPECT_NEAR(sphere.Agreement(-1), -sphere.Agreement(), 1e-9);
  // Normals that are opposite to the first of their patch.
  for (int i = 0; i < sphere.cloud.points.cols(); i += 3) {
    sphere.cloud.normals.col(i) *= -1;
    sphere.patches.parity[i] = 1;
  }
  EXPECT_GT(sphere.Agreement(), 2);
}

TEST(PatchDipolesTest, ADiscAgreesWithTheSheetAroundIt) {
  const auto in_the_middle = [](const Eigen::Vector3d& at) {
    return (at - Eigen::Vector3d(0.5, 0.5, 0)).norm() < 0.2;
  };
  EXPECT_GT(TwoPatches(PlaneCloud(4000, 2), 1, in_the_middle).Agreement(), 2);
}

TEST(PatchDipolesTest, TheFacesOfAPlateAgree) {
  const auto is_top = [](const Eigen::Vector3d& at) { return at.z() > 0; };
  EXPECT_GT(TwoPatches(BoxCloud(4000, 3, {1, 1, 0.1}), 2.4, is_top).Agreement(), 2);
}

// A surface of 3000 points over the middle of a sheet of 4000.
TwoPatches OverASheet(KnownCloud both) {
  const KnownCloud sheet = PlaneCloud(4000, 5);
  both.cloud.points *= 0.2;
  const auto count = sheet.cloud.points.cols();
  both.cloud.points.conservativeResize(3, both.cloud.points.cols() + count);
  both.normals.conservativeResize(3, both.cloud.points.cols());
  both.cloud.points.rightCols(count) =
      sheet.cloud.points.colwise() - Eigen::Vector3d(0.5, 0.5, 0.3);
  both.normals.rightCols(count) = sheet.normals;
  return TwoPatches(both, 1, [](const Eigen::Vector3d& at) { return at.z() < -0.25; });
}

// Outside a closed surface the winding number is 0 whichever way it faces. It finds its own side.
TEST(PatchDipolesTest, AClosedBallOverASheetStaysApart) {
  const TwoPatches ball = OverASheet(SphereCloud(3000, 4));
  for (const double balance : {-0.7, 0.0, 0.7}) EXPECT_FALSE(ball.Relation(balance)) << balance;
  EXPECT_GT(ball.Relation(1.0).value(), 0.8);
}

// A flat sheet off another one hangs on its votes, for it does not show which side is outside.
TEST(PatchDipolesTest, AFlatSheetOverASheetFollowsWhatIsKnown) {
  KnownCloud flat = PlaneCloud(3000, 8);
  flat.cloud.points.row(0).array() -= 4;
  const TwoPatches sheets = OverASheet(flat);
  EXPECT_NEAR(sheets.Relation(0.5).value(), 0.5 + sheets.Agreement(), 1e-9);
  EXPECT_NEAR(sheets.Agreement(), 0, 0.5);
}

TEST(PatchDipolesTest, Stops) {
  const TwoPatches sphere(SphereCloud(500, 7), 4 * M_PI, AtTheTop);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const SignedNode a{0, 1}, b{1, 1};
  EXPECT_EQ(PatchDipoles(sphere.patches, sphere.cloud)
                .Relation(0, {&a, 1}, {&b, 1}, context)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

TEST(PatchDipolesTest, AFewPointsFollowTheirVotes) {
  const auto is_third = [i = 0](const Eigen::Vector3d&) mutable { return i++ == 3; };
  EXPECT_EQ(TwoPatches(SphereCloud(500, 6), 4 * M_PI, is_third).Relation(0.3), 0.3);
}

}  // namespace
}  // namespace rilievo
