#include "core/scan/orientation/inverted_components.h"

#include <gtest/gtest.h>

#include "core/scan/orientation/edge_sign_votes.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

// Gives the cloud its true normals, but for those of `wrong` points, lets the winding number judge
// them, and tells what share is wrong then.
template <typename IsWrong>
double WrongAfterTurning(const KnownCloud& known, const IsWrong& is_wrong) {
  const RunContext context;
  const PreparedCloud prepared = Prepare(known);
  OrientedCloud cloud =
      EstimateNormals(prepared.scan.points, prepared.graph, {}, context).value().cloud;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double sign = is_wrong(known.cloud.points.col(prepared.scan.source_index[i])) ? -1 : 1;
    cloud.normals.col(i) = sign * prepared.normals.col(i);
  }
  const std::vector<float> relations = EdgeSignVotes(prepared.graph, cloud, context).value();
  const OrientationPatches patches = SurePatches(prepared.graph, relations, context).value();
  std::vector<SignedLink> links =
      LinksBetween(patches, prepared.graph, relations, cloud, context).value();
  EXPECT_TRUE(FlipInvertedComponents(patches, links, &cloud, context).ok());
  return WrongShare(cloud.normals, prepared.normals);
}

// A large sphere and a small one that grow together: what is inside the other is gone.
KnownCloud BodyWithLimb() {
  const Eigen::Vector3d limb(1.25, 0, 0);
  const KnownCloud both = Concatenate(SphereCloud(9000, 1), SphereCloud(1500, 2, 0.4, limb));
  std::vector<int> kept;
  for (int i = 0; i < both.cloud.points.cols(); ++i) {
    const Eigen::Vector3d at = both.cloud.points.col(i);
    if (at.norm() > 0.999 && (at - limb).norm() > 0.399) kept.push_back(i);
  }
  return {{both.cloud.points(Eigen::all, kept)}, both.normals(Eigen::all, kept)};
}

const Eigen::Vector3d kHollow(0.65, 0, 0);

// A sphere that another one has hollowed out, through an opening narrower than that.
KnownCloud BodyWithHollow() {
  KnownCloud hollow = SphereCloud(1500, 4, 0.4, kHollow);
  hollow.normals *= -1;
  const KnownCloud both = Concatenate(SphereCloud(9000, 3), hollow);
  std::vector<int> kept;
  for (int i = 0; i < both.cloud.points.cols(); ++i) {
    const Eigen::Vector3d at = both.cloud.points.col(i);
    const bool outer = (at - kHollow).norm() > 0.401;
    if (outer || at.norm() < 0.999) kept.push_back(i);
  }
  return {{both.cloud.points(Eigen::all, kept)}, both.normals(Eigen::all, kept)};
}

bool InHollow(const Eigen::Vector3d& at) {
  return (at - kHollow).norm() < 0.42 && at.norm() < 0.98;
}

bool InLimb(const Eigen::Vector3d& at) { return at.x() > 1; }

// A tenth of all; patches at the neck may stay.
TEST(InsideOutTest, ALimbIsTurned) { EXPECT_LT(WrongAfterTurning(BodyWithLimb(), InLimb), 0.02); }

TEST(InsideOutTest, ALimbIsTurnedUnderNoise) {
  KnownCloud known = BodyWithLimb();
  AddNoise(0.03, 8, &known);
  EXPECT_LT(WrongAfterTurning(known, InLimb), 0.06);
}

TEST(InsideOutTest, AHollowIsTurned) {
  EXPECT_LT(WrongAfterTurning(BodyWithHollow(), InHollow), 0.02);
}

TEST(InsideOutTest, AHollowThatIsRightStays) {
  EXPECT_EQ(WrongAfterTurning(BodyWithHollow(), [](const Eigen::Vector3d&) { return false; }), 0);
}

TEST(InsideOutTest, AnOpenShellThatIsRightStays) {
  EXPECT_EQ(WrongAfterTurning(CutBelow(SphereCloud(10000, 9), 0),
                              [](const Eigen::Vector3d&) { return false; }),
            0);
}

TEST(InsideOutTest, WhatIsRightStays) {
  EXPECT_EQ(WrongAfterTurning(BodyWithLimb(), [](const Eigen::Vector3d&) { return false; }), 0);
}

TEST(InsideOutTest, NoiseAsThickAsTheSpacingChangesNothing) {
  KnownCloud known = BodyWithLimb();
  AddNoise(0.04, 4, &known);
  EXPECT_EQ(WrongAfterTurning(known, [](const Eigen::Vector3d&) { return false; }), 0);
}

TEST(InsideOutTest, AnOpenSheetCannotTell) {
  EXPECT_NEAR(WrongAfterTurning(PlaneCloud(5000, 7),
                                [](const Eigen::Vector3d& at) { return at.x() < 0.3; }),
              0.3, 0.03);
}

}  // namespace
}  // namespace rilievo
