#include "core/domain/suzuki_update.h"

#include <gtest/gtest.h>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

FootPoints NoFeet(int samples) {
  FootPoints feet;
  feet.normals.setZero(3, samples);
  feet.conormals.setZero(3, samples);
  feet.offset.assign(static_cast<size_t>(samples), 0.0);
  feet.weight.assign(static_cast<size_t>(samples), 0.0);
  feet.border_offset.assign(static_cast<size_t>(samples), 0.0);
  feet.border_weight.assign(static_cast<size_t>(samples), 0.0);
  return feet;
}

TEST(SuzukiUpdate, MovesByLambdaTimesTheMiss) {
  const ControlMesh mesh = OctahedralSphere(0.3, 2);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  FootPoints feet = NoFeet(samples->size());
  Random random(3);
  for (int i = 0; i < samples->size(); ++i) {
    feet.normals.col(i) = RandomDirection(&random);
    feet.offset[i] = random.Uniform(-0.01, 0.01);
    feet.weight[i] = random.Uniform(0.5, 1);
  }
  Eigen::Matrix3Xd points = mesh.vertices;
  SuzukiUpdate(*samples, feet, 0.8, &points);
  for (int i = 0; i < samples->control_vertex_count(); ++i) {
    const Eigen::Vector3d move = 0.8 * feet.weight[i] * feet.offset[i] * feet.normals.col(i);
    EXPECT_LT((points.col(i) - mesh.vertices.col(i) - move).norm(), 1e-15);
  }
}

TEST(SuzukiUpdate, HoleTravelsWithItsRim) {
  const ControlMesh mesh = OctahedralSphere(0.3, 3);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  FootPoints feet = NoFeet(samples->size());
  const Eigen::Vector3d way(0, 0, 0.01);
  int without_data = 0;
  for (int i = 0; i < samples->size(); ++i) {
    const bool hole = i < samples->control_vertex_count() && mesh.vertices(2, i) > 0.25;
    without_data += hole;
    feet.normals.col(i) = Eigen::Vector3d::UnitZ();
    if (hole) continue;
    feet.offset[i] = 0.01;
    feet.weight[i] = 1;
  }
  ASSERT_GT(without_data, 5);
  Eigen::Matrix3Xd points = mesh.vertices;
  SuzukiUpdate(*samples, feet, 1.0, &points);
  for (int i = 0; i < samples->control_vertex_count(); ++i) {
    EXPECT_LT((points.col(i) - mesh.vertices.col(i) - way).norm(), 5e-4) << i;
  }
}

TEST(SuzukiUpdate, BoundaryFollowsTheBorder) {
  const ControlMesh mesh = OctahedralSphere(0.3, 2, true);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  FootPoints feet = NoFeet(samples->size());
  for (int i = 0; i < samples->size(); ++i) {
    feet.weight[i] = 1;
    if (!samples->on_boundary(i)) continue;
    feet.conormals.col(i) = -Eigen::Vector3d::UnitZ();
    feet.border_offset[i] = 0.02;
    feet.border_weight[i] = 1;
  }
  Eigen::Matrix3Xd points = mesh.vertices;
  SuzukiUpdate(*samples, feet, 0.5, &points);
  for (int i = 0; i < samples->control_vertex_count(); ++i) {
    const double expected = samples->on_boundary(i) ? -0.01 : 0;
    EXPECT_NEAR(points(2, i) - mesh.vertices(2, i), expected, 1e-15);
  }
}

}  // namespace
}  // namespace rilievo
