#include "core/domain/sample_targets.h"

#include <gtest/gtest.h>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

struct Aiming {
  explicit Aiming(bool open)
      : mesh(OctahedralSphere(0.3, 2, open)),
        samples(*BuildDomainSamples(mesh, 2, RunContext())),
        targets(MakeSampleTargets(samples)) {
    EXPECT_TRUE(SampleSurface(samples, mesh.vertices, RunContext(), &surface).ok());
    areas = ShareArea(samples, surface);
    const auto count = static_cast<size_t>(samples.size());
    feet.normals = surface.normals;
    feet.offset.assign(count, 0.01);
    feet.weight.assign(count, 0.25);
    feet.conormals.setZero(3, samples.size());
    feet.border_offset.assign(count, 0.0);
    feet.border_weight.assign(count, 0.0);
  }
  void Aim(double tangential_weight) {
    EXPECT_TRUE(
        AimSamples(samples, surface, feet, areas, tangential_weight, RunContext(), &targets).ok());
  }
  // Squared weight of a miss of sample i by `miss`.
  double Cost(int i, const Eigen::Vector3d& miss) const {
    double cost = 0;
    for (int r = 0; r < targets.row_count[i]; ++r) {
      cost += std::pow(targets.weighted_directions.block<3, 1>(3 * r, i).dot(miss), 2);
    }
    return cost;
  }

  ControlMesh mesh;
  DomainSamples samples;
  SampledSurface surface;
  AreaShares areas;
  FootPoints feet;
  SampleTargets targets;
};

TEST(SampleTargets, WeighNormalAndTangentialMisses) {
  Aiming aiming(false);
  aiming.Aim(0.1);
  for (int i = 0; i < aiming.samples.size(); ++i) {
    const Eigen::Vector3d normal = aiming.surface.normals.col(i);
    const Eigen::Vector3d beside = normal.unitOrthogonal();
    EXPECT_LT(
        (aiming.targets.positions.col(i) - aiming.surface.positions.col(i) - 0.01 * normal).norm(),
        1e-15);
    EXPECT_NEAR(aiming.Cost(i, normal), 0.25 * aiming.areas.samples[i], 1e-15);
    const bool corner = i < aiming.samples.control_vertex_count();
    const double expected = corner ? 0.1 * aiming.areas.control_vertices[i] : 0;
    EXPECT_NEAR(aiming.Cost(i, beside), expected, 1e-15);
    EXPECT_NEAR(aiming.Cost(i, normal.cross(beside)), expected, 1e-15);
  }
}

TEST(SampleTargets, AskNothingWithoutData) {
  Aiming aiming(false);
  aiming.feet.weight.assign(aiming.feet.weight.size(), 0.0);
  aiming.Aim(0.1);
  for (int i = 0; i < aiming.samples.size(); ++i) {
    EXPECT_LE(aiming.Cost(i, Eigen::Vector3d::UnitX()), 1e-9) << i;
  }
}

TEST(SampleTargets, BoundaryIsDrawnToTheBorder) {
  Aiming aiming(true);
  for (int i = 0; i < aiming.samples.size(); ++i) {
    if (!aiming.samples.on_boundary(i)) continue;
    aiming.feet.conormals.col(i) = aiming.surface.normals.col(i).unitOrthogonal();
    aiming.feet.border_offset[i] = 0.02;
    aiming.feet.border_weight[i] = 1;
  }
  aiming.Aim(0.0);
  for (int i = 0; i < aiming.samples.size(); ++i) {
    const Eigen::Vector3d conormal = aiming.feet.conormals.col(i);
    const double pull = aiming.Cost(i, conormal) / aiming.areas.samples[i];
    if (aiming.samples.on_boundary(i)) {
      EXPECT_GT(pull, 0.1);
      EXPECT_LT(pull, 0.5);
      const Eigen::Vector3d way = aiming.targets.positions.col(i) - aiming.surface.positions.col(i);
      EXPECT_NEAR(way.dot(conormal), 0.02, 1e-12);
    } else {
      EXPECT_EQ(pull, 0);
    }
  }
}

}  // namespace
}  // namespace rilievo
