#include "core/booleans/solid_crossings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

std::array<GridSolid, 2> Placed(const TriangleMesh& a, const TriangleMesh& b) {
  return PlaceOnGrid(a, b, {}, RunContext()).value();
}

// A bar through two faces of a box: its four long edges pass both.
TEST(SolidCrossingsTest, ABarThroughABox) {
  const TriangleMesh box = UnitBox(0, 0, 0), bar = BoxMesh({.31, .27, -1}, {.64, .71, 2});
  const auto solids = Placed(box, bar);
  const auto found = FindCrossings(solids, RunContext());
  ASSERT_TRUE(found.ok());
  int entering = 0, of_bar = 0;
  for (const Crossing& crossing : found->all) {
    entering += crossing.enters;
    of_bar += crossing.side == 1;
    EXPECT_GT(crossing.place.parameter(), 0);
    EXPECT_LT(crossing.place.parameter(), 1);
  }
  // Besides its four long edges the four diagonals of its long sides pass both faces of the box.
  EXPECT_EQ(of_bar, 16);
  EXPECT_EQ(2 * entering, static_cast<int>(found->all.size()));
  EXPECT_EQ(found->windings[0], std::vector<int>(8, 0));
  EXPECT_EQ(found->windings[1], std::vector<int>(8, 0));
}

TEST(SolidCrossingsTest, WindingsTellWhatLiesInside) {
  std::mt19937_64 random(4);
  const TriangleMesh ball = SphereMesh(4);
  for (int i = 0; i < 10; ++i) {
    const Eigen::Affine3d pose = RandomPose(.8, random);
    const TriangleMesh box = Moved(BoxMesh({-.5, -.5, -.5}, {.5, .5, .5}), pose);
    const auto found = FindCrossings(Placed(ball, box), RunContext());
    ASSERT_TRUE(found.ok());
    for (Eigen::Index v = 0; v < ball.vertices.cols(); ++v) {
      const Eigen::Vector3d local = pose.inverse() * ball.vertices.col(v);
      const double beyond = local.cwiseAbs().maxCoeff() - .5;
      if (std::abs(beyond) < 1e-9) continue;
      EXPECT_EQ(found->windings[0][static_cast<size_t>(v)], beyond < 0 ? 1 : 0);
    }
    for (Eigen::Index v = 0; v < 8; ++v) {
      const double radius = box.vertices.col(v).norm();
      if (radius > .99 && radius < 1) continue;  // within a chord of the ball
      EXPECT_EQ(found->windings[1][static_cast<size_t>(v)], radius < 1 ? 1 : 0);
    }
  }
}

TEST(SolidCrossingsTest, ThoseOfAnEdgeAreInTheirOrder) {
  const TriangleMesh torus = TorusMesh(1, .3, 40, 20);
  const auto solids = Placed(BoxMesh({-2, -.05, -.06}, {2, .04, .05}), torus);
  const auto found = FindCrossings(solids, RunContext());
  ASSERT_TRUE(found.ok());
  size_t longest = 0, run = 1;
  for (size_t i = 1; i < found->all.size(); ++i) {
    const Crossing &a = found->all[i - 1], &b = found->all[i];
    if (a.side != b.side || a.half_edge != b.half_edge) {
      run = 1;
      continue;
    }
    longest = std::max(longest, ++run);
    EXPECT_TRUE(a.place.Before(b.place));
    EXPECT_FALSE(b.place.Before(a.place));
    EXPECT_LE(a.place.parameter(), b.place.parameter());
    EXPECT_NE(a.enters, b.enters);
  }
  EXPECT_EQ(longest, 4u);  // in, out, in, out
}

TEST(SolidCrossingsTest, ASolidWoundTwiceAroundAPlaceIsRefused) {
  const TriangleMesh twice = Together(UnitBox(0, 0, 0), UnitBox(.5, .1, .2));
  const auto found = FindCrossings(Placed(twice, UnitBox(.6, .3, .4)), RunContext());
  EXPECT_EQ(found.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(found.status().message()), HasSubstr("overlaps itself"));
}

// A corner of a tetrahedron 1e-3 above a box's face touches it only where growing takes it there.
TEST(SolidCrossingsTest, ContactsAreWhereGrowingDecides) {
  const TriangleMesh box = UnitBox(0, 0, 0);
  for (const double gap : {0.0, 1e-3}) {
    const TriangleMesh tip = MeshOf({{.4, .3, 1 + gap}, {.3, .3, 2}, {.6, .3, 2}, {.4, .7, 2}},
                                    {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}});
    const auto grown = PlaceOnGrid(box, tip, {0, kGrowthSteps}, RunContext()).value();
    const auto found = FindCrossings(grown, RunContext());
    ASSERT_TRUE(found.ok());
    const auto contacts = FindContacts(grown, found->all, RunContext());
    ASSERT_TRUE(contacts.ok());
    if (gap > 0) {
      EXPECT_TRUE(contacts->empty());
      continue;
    }
    ASSERT_EQ(contacts->size(), 8 + 4 + found->all.size());
    // All of the tip, and all crossings; of the box a triangle of the face.
    EXPECT_EQ(std::count(contacts->begin() + 8, contacts->end(), 1),
              static_cast<int64_t>(4 + found->all.size()));
    EXPECT_EQ(std::count(contacts->begin(), contacts->begin() + 8, 1), 3);
  }
}

}  // namespace
}  // namespace rilievo
