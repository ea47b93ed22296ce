#include "core/scan/local_shape/adaptive_patches.h"

#include <gtest/gtest.h>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

struct Widened {
  std::vector<PatchMoments> before, after;
  Eigen::Matrix3Xd normals;
};

// `noise`: unit of the sphere, told to the stage as it is.
Widened WidenOn(const KnownCloud& known, double noise, Eigen::Matrix3Xd* truth) {
  const PreparedCloud prepared = Prepare(known);
  const size_t count = static_cast<size_t>(prepared.scan.points.cols());
  const std::vector<float> level(count, static_cast<float>(noise / prepared.scan.frame.diagonal));
  std::vector<float> spacing(count);
  for (size_t i = 0; i < count; ++i) {
    spacing[i] =
        NeighborDistances(prepared.scan.points, prepared.graph, static_cast<int>(i)).back() / 2;
  }
  Widened result;
  result.before = ComputePatchMoments(prepared.scan.points, prepared.graph, RunContext{}).value();
  result.after = result.before;
  std::vector<PatchPlane> planes;
  for (const PatchMoments& patch : result.before) planes.push_back(FitPlane(patch));
  EXPECT_TRUE(AdaptPatches(prepared.scan.points, prepared.graph, level, spacing, RunContext{},
                           &result.after, &planes)
                  .ok());
  result.normals.resize(3, static_cast<int64_t>(count));
  for (size_t i = 0; i < count; ++i) {
    EXPECT_EQ(planes[i].normal, FitPlane(result.after[i]).normal);
    result.normals.col(i) = planes[i].normal;
  }
  *truth = prepared.normals;
  return result;
}

TEST(AdaptPatchesTest, LeavesCleanPatchesAlone) {
  Eigen::Matrix3Xd truth;
  const Widened widened = WidenOn(BoxCloud(5000, 1, {1, 1, 1}), 0, &truth);
  for (size_t i = 0; i < widened.before.size(); ++i) {
    ASSERT_EQ(widened.before[i].covariance, widened.after[i].covariance);
    ASSERT_EQ(widened.before[i].mean_offset, widened.after[i].mean_offset);
  }
}

// Spacing 0.02 of the radius; noise of half, one and two spacings.
TEST(AdaptPatchesTest, KeepsNormalsRightAsNoiseGrowsPastTheSpacing) {
  for (const double noise : {0.01, 0.02, 0.04}) {
    KnownCloud sphere = SphereCloud(40000, 2);
    AddNoise(noise, 3, &sphere);
    Eigen::Matrix3Xd truth;
    const Widened widened = WidenOn(sphere, noise, &truth);
    Eigen::Matrix3Xd narrow(3, truth.cols());
    for (size_t i = 0; i < widened.before.size(); ++i) {
      narrow.col(i) = FitPlane(widened.before[i]).normal;
    }
    EXPECT_LT(MeanLineAngle(widened.normals, truth), 7) << noise;
    EXPECT_GT(MeanLineAngle(narrow, truth), 2 * MeanLineAngle(widened.normals, truth)) << noise;
  }
}

}  // namespace
}  // namespace rilievo
