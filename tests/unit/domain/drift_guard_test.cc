#include "core/domain/drift_guard.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

struct Straying {
  OrientedCloud cloud = SphereCloud(0.3, 5'000);
  PointIndex index{cloud.points};
  ControlMesh mesh = OctahedralSphere(0.3, 2);
  DomainSamples samples = *BuildDomainSamples(mesh, 2, RunContext());
  SampledSurface surface;

  void Sample(const Eigen::Matrix3Xd& points) {
    EXPECT_TRUE(SampleSurface(samples, points, RunContext(), &surface).ok());
  }
  std::vector<float> Gaps() const {
    return *GapsToPoints(cloud, index, samples, surface, RunContext());
  }
};

TEST(StrayGuard, GapsAreInSpacingsLessTheNoise) {
  Straying straying;
  straying.Sample(straying.mesh.vertices);
  const Eigen::Vector3d at = straying.surface.positions.col(20);
  straying.cloud.points.colwise() = at + Eigen::Vector3d(0, 0, 0.03);
  straying.cloud.spacing.assign(straying.cloud.spacing.size(), 0.01f);
  straying.cloud.noise.assign(straying.cloud.noise.size(), 0.005f);
  const PointIndex index(straying.cloud.points);
  const auto gaps =
      *GapsToPoints(straying.cloud, index, straying.samples, straying.surface, RunContext());
  EXPECT_EQ(gaps.size(), static_cast<size_t>(straying.mesh.vertices.cols()));
  EXPECT_NEAR(gaps[20], 2.5, 1e-4);
  straying.cloud.spacing.assign(straying.cloud.spacing.size(), 0.0f);
  EXPECT_EQ(
      (*GapsToPoints(straying.cloud, index, straying.samples, straying.surface, RunContext()))[20],
      0);
}

TEST(StrayGuard, TakesBackWhatLeftThePointsAlone) {
  Straying straying;
  Eigen::Matrix3Xd points = straying.mesh.vertices;
  points.col(20) *= 1.6;
  points.col(5) *= 1.001;
  straying.Sample(points);
  const size_t count = static_cast<size_t>(points.cols());
  std::vector<float> gaps(count, 0.2f);
  gaps[20] = 2;
  const Eigen::Vector3d kept = points.col(5);
  ASSERT_TRUE(UndoDrift(straying.samples, straying.mesh.vertices, std::vector<float>(count, 0.1f),
                        gaps, RunContext(), &points, &straying.surface)
                  .ok());
  EXPECT_EQ(points.col(20), straying.mesh.vertices.col(20));
  EXPECT_EQ(points.col(5), kept);
  const Eigen::Matrix3Xd returned = straying.surface.positions;
  straying.Sample(points);
  EXPECT_EQ(returned, straying.surface.positions);
}

// Within a spacing, or hardly farther than before: the fit knows better.
TEST(StrayGuard, LeavesTheRestToTheFit) {
  Straying straying;
  Eigen::Matrix3Xd points = 1.1 * straying.mesh.vertices;
  straying.Sample(points);
  const Eigen::Matrix3Xd moved = points;
  const size_t count = static_cast<size_t>(points.cols());
  const auto undo = [&](float start, float now) {
    return UndoDrift(straying.samples, straying.mesh.vertices, std::vector<float>(count, start),
                     std::vector<float>(count, now), RunContext(), &points, &straying.surface)
        .ok();
  };
  EXPECT_TRUE(undo(1.3f, 1.9f));
  EXPECT_TRUE(undo(4.0f, 5.8f));
  EXPECT_TRUE(undo(0.1f, 0.9f));
  EXPECT_TRUE(undo(0.8f, 1.2f));
  EXPECT_EQ(points, moved);
  for (const auto& [start, now] : {std::pair(0.8f, 1.4f), {1.3f, 2.0f}, {4.0f, 6.2f}}) {
    points = moved;
    EXPECT_TRUE(undo(start, now));
    EXPECT_EQ(points, straying.mesh.vertices);
  }
}

}  // namespace
}  // namespace rilievo
