#include "core/domain/cloud_assignment.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/points/settings.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

struct Scene {
  OrientedCloud cloud;
  ControlMesh mesh;
  DomainSamples samples;
  SampledSurface surface;
};

Scene MakeScene(OrientedCloud cloud, ControlMesh mesh, int level) {
  Scene scene{std::move(cloud), std::move(mesh), {}, {}};
  scene.samples = *BuildDomainSamples(scene.mesh, level, RunContext());
  EXPECT_TRUE(SampleSurface(scene.samples, scene.mesh.vertices, RunContext(), &scene.surface).ok());
  return scene;
}

std::vector<int> SampleOfPoint(const Scene& scene, const CloudAssignment& assignment) {
  std::vector<int> sample(static_cast<size_t>(scene.cloud.points.cols()), -1);
  for (int s = 0; s < scene.samples.size(); ++s) {
    for (int point : assignment.PointsOf(s)) sample[static_cast<size_t>(point)] = s;
  }
  return sample;
}

// Nearest sample with an agreeing normal, the slow way.
double NearestAgreeing(const Scene& scene, int point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int s = 0; s < scene.samples.size(); ++s) {
    if (scene.cloud.normals.col(point).dot(scene.surface.normals.col(s)) <= kCommon.same_sheet) {
      continue;
    }
    nearest =
        std::min(nearest, (scene.cloud.points.col(point) - scene.surface.positions.col(s)).norm());
  }
  return nearest;
}

void ExpectNearest(const Scene& scene, const CloudAssignment& assignment) {
  const std::vector<int> sample = SampleOfPoint(scene, assignment);
  for (int point = 0; point < scene.cloud.points.cols(); ++point) {
    ASSERT_GE(sample[static_cast<size_t>(point)], 0) << point;
    const double distance = (scene.cloud.points.col(point) -
                             scene.surface.positions.col(sample[static_cast<size_t>(point)]))
                                .norm();
    ASSERT_DOUBLE_EQ(distance, NearestAgreeing(scene, point)) << point;
  }
}

TEST(CloudAssignment, FindsTheNearestSample) {
  const Scene scene = MakeScene(TorusCloud(0.25, 0.1, 2000), TorusMesh(0.25, 0.1, 12, 8), 2);
  CloudAssignment assignment(scene.cloud, scene.samples);
  ASSERT_TRUE(assignment.Update(scene.surface, RunContext()).ok());
  ExpectNearest(scene, assignment);
}

TEST(CloudAssignment, WalkFollowsTheSurfaceWhereItMoves) {
  Scene scene = MakeScene(TorusCloud(0.25, 0.1, 2000), TorusMesh(0.25, 0.1, 12, 8), 2);
  CloudAssignment assignment(scene.cloud, scene.samples);
  ASSERT_TRUE(assignment.Update(scene.surface, RunContext()).ok());
  // Turned by a control edge: every point has to walk several samples.
  const Eigen::AngleAxisd turn(0.5, Eigen::Vector3d::UnitZ());
  scene.surface.positions = turn.toRotationMatrix() * scene.surface.positions;
  scene.surface.normals = turn.toRotationMatrix() * scene.surface.normals;
  ASSERT_TRUE(assignment.Update(scene.surface, RunContext()).ok());
  ExpectNearest(scene, assignment);
}

// Points of the upper sheet stay off the lower one, also where that is nearer.
TEST(CloudAssignment, KeepsTheSheetsOfAThinWallApart) {
  const Eigen::Vector3d half(0.4, 0.3, 0.005);
  Scene scene = MakeScene(BoxCloud(half, 5000), BoxMesh(half, 0.05), 2);
  scene.surface.positions.row(2).array() += 0.012;
  CloudAssignment assignment(scene.cloud, scene.samples);
  ASSERT_TRUE(assignment.Update(scene.surface, RunContext()).ok());
  int checked = 0;
  for (int s = 0; s < scene.samples.size(); ++s) {
    for (int point : assignment.PointsOf(s)) {
      EXPECT_GT(scene.cloud.normals.col(point).dot(scene.surface.normals.col(s)),
                kCommon.same_sheet);
      ++checked;
    }
  }
  EXPECT_GT(checked, 4500);
}

TEST(CloudAssignment, MeasuresTheOffsetOfTheCloud) {
  // A cloud on a sphere concentric with the samples' own: the halfway offset is exact there.
  Scene scene = MakeScene(SphereCloud(0.31, 3000), OctahedralSphere(0.3, 3), 1);
  for (int s = 0; s < scene.samples.size(); ++s) {
    scene.surface.normals.col(s) = scene.surface.positions.col(s).normalized();
    scene.surface.positions.col(s) = 0.3 * scene.surface.normals.col(s);
  }
  CloudAssignment assignment(scene.cloud, scene.samples);
  ASSERT_TRUE(assignment.Update(scene.surface, RunContext()).ok());
  EXPECT_NEAR(assignment.rms(), 0.01, 2e-5);
}

TEST(CloudAssignment, TakesAnEvenSubsetOfAnOversizedCloud) {
  const Scene scene = MakeScene(SphereCloud(0.3, 400'000), OctahedralSphere(0.3, 1), 1);
  const CloudAssignment assignment(scene.cloud, scene.samples);
  EXPECT_LE(assignment.subset_size(), 150'000);
  EXPECT_GE(assignment.subset_size(), 100'000);
}

TEST(CloudAssignment, HalfwayNormalSeesNoOffsetOnASphere) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d a = RandomDirection(&random);
    const Eigen::Vector3d b = (a + 0.3 * RandomDirection(&random)).normalized();
    EXPECT_NEAR(HalfwayNormal(a, b).dot(b - a), 0, 1e-15);
    EXPECT_NEAR(HalfwayNormal(a, b).dot(1.25 * b - a), 0.25, 0.01);
  }
}

}  // namespace
}  // namespace rilievo
