#include "core/domain/fairness.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <stop_token>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

double Energy(const ControlMesh& mesh, double weight) {
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  SampledSurface surface;
  EXPECT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
  const AreaShares shares = ShareArea(*samples, surface);
  double energy = 0;
  for (int v = 0; v < samples->control_vertex_count(); ++v) {
    const Umbrella umbrella = UmbrellaOf(*samples, v);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (size_t k = 1; k < umbrella.vertices.size(); ++k) {
      mean += mesh.vertices.col(umbrella.vertices[k]) / (umbrella.vertices.size() - 1.0);
    }
    energy += weight * shares.control_vertices[v] * (mean - mesh.vertices.col(v)).squaredNorm();
  }
  return energy;
}

TEST(Fairness, FlatRegularMeshInsideItsBoundaryHasNone) {
  const ControlMesh torus = TorusMesh(0.25, 0.1, 12, 8);
  const auto samples = BuildDomainSamples(torus, 1, RunContext());
  // The umbrella of a regular lattice vertex, laid out flat, is balanced.
  const Umbrella umbrella = UmbrellaOf(*samples, 20);
  ASSERT_EQ(umbrella.vertices.size(), 7u);
  const int directions[6][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 0}, {-1, -1}, {0, -1}};
  Eigen::Vector2i sum = Eigen::Vector2i::Zero();
  for (const auto& d : directions) sum += Eigen::Vector2i(d[0], d[1]);
  EXPECT_EQ(sum, Eigen::Vector2i::Zero());
  const std::set<int> neighbors(umbrella.vertices.begin() + 1, umbrella.vertices.end());
  for (const auto& d : directions) {
    const int i = (20 / 8 + d[0] + 12) % 12, j = (20 % 8 + d[1] + 8) % 8;
    EXPECT_TRUE(neighbors.contains(i * 8 + j));
  }
}

TEST(Fairness, BoundaryVertexSeesItsBoundaryNeighborsOnly) {
  const ControlMesh mesh = OctahedralSphere(0.3, 2, true);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  int boundary = 0;
  for (int v = 0; v < samples->control_vertex_count(); ++v) {
    const Umbrella umbrella = UmbrellaOf(*samples, v);
    EXPECT_EQ(umbrella.vertices[0], v);
    if (!samples->on_boundary(v)) continue;
    ++boundary;
    ASSERT_EQ(umbrella.vertices.size(), 3u);
    for (int u : umbrella.vertices) EXPECT_NEAR(mesh.vertices(2, u), 0, 1e-15);
  }
  EXPECT_EQ(boundary, 16);
}

// A length squared: twice the size, four times the energy; the same whatever the unit otherwise.
TEST(Fairness, ScalesAsTheDataTermDoes) {
  ControlMesh mesh = OctahedralSphere(0.3, 2);
  const double energy = Energy(mesh, 0.5);
  mesh.vertices *= 2;
  EXPECT_NEAR(Energy(mesh, 0.5), 4 * energy, 1e-12);
  EXPECT_NEAR(Energy(mesh, 1.0), 8 * energy, 1e-12);
  // On a smooth surface the umbrella shrinks with the square of the edges.
  EXPECT_NEAR(Energy(TorusMesh(0.25, 0.1, 80, 40), 0.5) / Energy(TorusMesh(0.25, 0.1, 40, 20), 0.5),
              1.0 / 16, 0.002);
}

TEST(Fairness, IsLoweredFromStartToEnd) {
  EXPECT_DOUBLE_EQ(FairnessOfRound(1e-2, 1e-4, 0, 3), 1e-2);
  EXPECT_DOUBLE_EQ(FairnessOfRound(1e-2, 1e-4, 1, 3), 1e-3);
  EXPECT_DOUBLE_EQ(FairnessOfRound(1e-2, 1e-4, 2, 3), 1e-4);
  EXPECT_DOUBLE_EQ(FairnessOfRound(1e-2, 1e-4, 0, 1), 1e-4);
  EXPECT_DOUBLE_EQ(FairnessOfRound(1, 0, 1, 3), 0.5);
  EXPECT_DOUBLE_EQ(FairnessOfRound(0, 0, 1, 3), 0);
}

TEST(Fairness, ActsAlongCreasesAndNotInCorners) {
  const Eigen::Vector3d half(0.3, 0.25, 0.2);
  const ControlMesh mesh = SharpBoxMesh(half, 0.1);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  int creases = 0, corners = 0;
  for (int v = 0; v < samples->control_vertex_count(); ++v) {
    const Eigen::Vector3d at = mesh.vertices.col(v);
    const auto sides = ((at.cwiseAbs() - half).cwiseAbs().array() < 1e-9).count();
    const Umbrella umbrella = UmbrellaOf(*samples, v);
    if (sides == 3) {
      EXPECT_EQ(umbrella.vertices.size(), 1u);
      ++corners;
    } else if (sides == 2) {
      ASSERT_EQ(umbrella.vertices.size(), 3u);
      const Eigen::Vector3d mean =
          (mesh.vertices.col(umbrella.vertices[1]) + mesh.vertices.col(umbrella.vertices[2])) / 2;
      EXPECT_LT((mean - at).norm(), 1e-12);
      ++creases;
    } else {
      EXPECT_GE(umbrella.vertices.size(), 5u);
    }
  }
  EXPECT_EQ(corners, 8);
  EXPECT_GT(creases, 40);
}

// Of spheres whose points have no noise below and noise of `thick` edges above.
TEST(FairnessWeights, GrowWhereNoiseIsThickAgainstFaces) {
  for (const double radius : {0.1, 0.3}) {
    const ControlMesh mesh = OctahedralSphere(radius, 2, false);
    const auto samples = BuildDomainSamples(mesh, 1, RunContext());
    SampledSurface surface;
    ASSERT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
    const AreaShares areas = ShareArea(*samples, surface);
    OrientedCloud cloud;
    cloud.points = surface.positions;
    const auto index = PointIndex::Build(cloud.points, RunContext());
    const std::vector<double>& shares = areas.control_vertices;
    double area = 0;
    for (const auto face : samples->finest().faces.colwise()) {
      const Eigen::Matrix3d corners = surface.positions(Eigen::all, face);
      area += (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).norm() / 2;
    }
    const double edge = std::sqrt(area / static_cast<double>(shares.size()));
    for (const double thick : {0.1, 0.2, 0.4}) {
      cloud.noise.assign(static_cast<size_t>(cloud.points.cols()), 0.0f);
      for (Eigen::Index i = 0; i < cloud.points.cols(); ++i) {
        if (cloud.points(2, i) > 0) cloud.noise[i] = static_cast<float>(thick * edge);
      }
      const auto weights = FairnessWeights(cloud, *index, surface, areas, RunContext());
      ASSERT_TRUE(weights.ok());
      for (int v = 0; v < samples->control_vertex_count(); ++v) {
        const double times = (*weights)[v] / shares[v];
        if (surface.positions(2, v) < -radius / 2 || thick == 0.1) {
          EXPECT_EQ(times, 1);
        } else if (surface.positions(2, v) > radius / 2) {
          const double least = std::sqrt(area * shares[v]) / edge;  // of a vertex of large faces
          EXPECT_NEAR(std::pow(times, 1.0 / 8), 7 * thick / std::max(1.0, least), 1e-4 * thick);
        }
      }
    }
  }
}

TEST(FairnessWeights, StopWhenAsked) {
  const ControlMesh mesh = OctahedralSphere(0.3, 2, false);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
  OrientedCloud cloud;
  cloud.points = surface.positions;
  cloud.noise.assign(static_cast<size_t>(cloud.points.cols()), 0.1f);
  const auto index = PointIndex::Build(cloud.points, RunContext());
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const auto stopped =
      FairnessWeights(cloud, *index, surface, ShareArea(*samples, surface), context);
  EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
