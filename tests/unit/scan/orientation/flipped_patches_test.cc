#include "core/scan/orientation/flipped_patches.h"

#include <gtest/gtest.h>

#include "core/scan/orientation/edge_sign_votes.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

struct Turned {
  double before = 0, after = 0;  // share of wrong normals
  Eigen::Matrix3Xd normals;      // after
};

// Gives the cloud its true normals, but for those of `wrong` patches, told by their first point.
// One in `right_votes` of the links between right and wrong patches says so. 0: none.
template <typename IsWrong>
Turned TurnWith(const KnownCloud& known, int right_votes, const IsWrong& is_wrong,
                int threads = 1) {
  RunContext context;
  context.threads = threads;
  const PreparedCloud prepared = Prepare(known);
  OrientedCloud cloud =
      EstimateNormals(prepared.scan.points, prepared.graph, {}, {}, context).value().cloud;
  cloud.normals = prepared.normals;
  const std::vector<float> relations = EdgeSignVotes(prepared.graph, cloud, context).value();
  const OrientationPatches patches = SurePatches(prepared.graph, relations, context).value();
  std::vector<SignedLink> links =
      LinksBetween(patches, prepared.graph, relations, cloud, context).value();
  std::vector<int> wrong(static_cast<size_t>(patches.count), -1);
  for (int i = 0; i < cloud.points.cols(); ++i) {
    int& patch = wrong[patches.patch[i]];
    if (patch < 0) patch = is_wrong(known.cloud.points.col(prepared.scan.source_index[i])) ? 1 : 0;
    if (patch == 1) cloud.normals.col(i) *= -1;
  }
  int across = 0;
  for (SignedLink& link : links) {
    link.weight = std::abs(link.weight);
    if (wrong[link.a] == wrong[link.b]) continue;
    if (right_votes > 0 && across++ % right_votes == 0) link.weight = -link.weight;
  }
  Turned turned;
  turned.before = WrongShare(cloud.normals, prepared.normals);
  EXPECT_TRUE(FlipInvertedPatches(patches, links, &cloud, context).ok());
  turned.normals = cloud.normals;
  turned.after = WrongShare(cloud.normals, prepared.normals);
  return turned;
}

// An ellipsoid as flat as an ear.
KnownCloud Ear(double thickness = 0.12) {
  KnownCloud known = SphereCloud(12000, 3);
  const Eigen::Vector3d axes(1, 0.7, thickness);
  for (int i = 0; i < known.cloud.points.cols(); ++i) {
    known.cloud.points.col(i) = axes.asDiagonal() * known.cloud.points.col(i);
    known.normals.col(i) = (axes.cwiseInverse().asDiagonal() * known.normals.col(i)).normalized();
  }
  return known;
}

bool OnOneFaceOfTheTip(const Eigen::Vector3d& at) { return at.z() > 0 && at.x() > 0.4; }
bool Nowhere(const Eigen::Vector3d&) { return false; }

TEST(FlippedFacesTest, OneFaceOfAThinLimbIsTurned) {
  const Turned turned = TurnWith(Ear(), 4, OnOneFaceOfTheTip);
  EXPECT_GT(turned.before, 0.08);
  EXPECT_EQ(turned.after, 0);
}

TEST(FlippedFacesTest, OneFaceOfAThinLimbIsTurnedUnderNoise) {
  KnownCloud known = Ear(0.16);
  AddNoise(0.015, 5, &known);
  const Turned turned = TurnWith(known, 4, OnOneFaceOfTheTip);
  EXPECT_GT(turned.before, 0.08);
  EXPECT_LT(turned.after, 0.01);
}

TEST(FlippedFacesTest, OneFaceOfAnOpenSheetIsTurned) {
  const auto in_the_middle = [](const Eigen::Vector3d& at) {
    return (at - Eigen::Vector3d(0.5, 0.5, 0)).norm() < 0.15;
  };
  const Turned turned = TurnWith(PlaneCloud(5000, 7), 4, in_the_middle);
  EXPECT_GT(turned.before, 0.05);
  EXPECT_EQ(turned.after, 0);
}

TEST(FlippedFacesTest, WithoutAVoteForItNothingIsTurned) {
  const Turned turned = TurnWith(Ear(), 0, OnOneFaceOfTheTip);
  EXPECT_EQ(turned.after, turned.before);
}

TEST(FlippedFacesTest, WhatIsRightStays) {
  EXPECT_EQ(TurnWith(Ear(0.02), 1, Nowhere).after, 0);
  EXPECT_EQ(TurnWith(BoxCloud(8000, 4, {1, 1, 0.02}), 1, Nowhere).after, 0);
  EXPECT_EQ(TurnWith(CutBelow(SphereCloud(10000, 9), 0), 1, Nowhere).after, 0);
}

TEST(FlippedFacesTest, AnyNumberOfThreadsTurnsTheSame) {
  KnownCloud known = Ear(0.16);
  AddNoise(0.02, 6, &known);
  const Turned one = TurnWith(known, 4, OnOneFaceOfTheTip, 1);
  EXPECT_LT(one.after, one.before);
  EXPECT_EQ(TurnWith(known, 4, OnOneFaceOfTheTip, 4).normals, one.normals);
}

}  // namespace
}  // namespace rilievo
