#include "core/domain/domain_samples.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

double Sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

TEST(DomainSamples, EachSampleBelongsToOneFaceThatItLiesOn) {
  const auto samples = BuildDomainSamples(OctahedralSphere(0.3, 1), 2, RunContext());
  ASSERT_TRUE(samples.ok());
  EXPECT_EQ(samples->size(), 32 * 16 / 2 + 2);
  EXPECT_EQ(samples->control_vertex_count(), 18);
  const FaceSamples on_faces = SamplesOfControlFaces(samples->refinement, 2);
  std::set<int> seen;
  for (int face = 0; face < samples->control_face_count(); ++face) {
    const auto first = on_faces.vertices.begin() + face * on_faces.per_face;
    const std::set<int> on_face(first, first + on_faces.per_face);
    for (int k = samples->owned_begin[face]; k < samples->owned_begin[face + 1]; ++k) {
      EXPECT_TRUE(on_face.contains(samples->owned[k]));
      EXPECT_TRUE(seen.insert(samples->owned[k]).second) << "owned twice";
    }
  }
  EXPECT_EQ(static_cast<int>(seen.size()), samples->size());
}

TEST(DomainSamples, SurfaceIsTheLimitThatRefinementEvaluates) {
  const ControlMesh mesh = OctahedralSphere(0.3, 2, true);
  const auto samples = BuildDomainSamples(mesh, 2, RunContext());
  ASSERT_TRUE(samples.ok());
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
  const auto limit = EvaluateLimit(samples->refinement, mesh.vertices, 2, RunContext());
  ASSERT_TRUE(limit.ok());
  EXPECT_LT((surface.positions - limit->positions).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((surface.normals - limit->normals).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(DomainSamples, BoundaryRunsCounterClockwiseSeenFromOutside) {
  const ControlMesh mesh = OctahedralSphere(0.3, 2, true);
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  ASSERT_TRUE(samples.ok());
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
  int on_boundary = 0;
  for (int i = 0; i < samples->size(); ++i) {
    EXPECT_EQ(samples->on_boundary(i), std::abs(surface.positions(2, i)) < 1e-12) << i;
    if (!samples->on_boundary(i)) continue;
    ++on_boundary;
    const int next = samples->boundary_next[i];
    EXPECT_EQ(samples->boundary_previous[next], i);
    const Eigen::Vector3d way = surface.positions.col(next) - surface.positions.col(i);
    const Eigen::Vector3d here = surface.positions.col(i);
    EXPECT_GT(here.cross(way).z(), 0);
  }
  EXPECT_EQ(on_boundary, 4 * 4 * 2);
}

TEST(DomainSamples, AreaSharesSumToOneAndFollowTheArea) {
  // One side of the box is 9 times as long as the other two: so are its shares.
  const ControlMesh mesh = BoxMesh({0.9, 0.1, 0.1}, 0.1);
  const auto samples = BuildDomainSamples(mesh, 2, RunContext());
  ASSERT_TRUE(samples.ok());
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
  const AreaShares shares = ShareArea(*samples, surface);
  EXPECT_NEAR(Sum(shares.samples), 1, 1e-12);
  EXPECT_NEAR(Sum(shares.control_vertices), 1, 1e-12);
  double half = 0;
  for (int i = 0; i < samples->size(); ++i) {
    if (surface.positions(0, i) > 1e-9) half += shares.samples[i];
    if (std::abs(surface.positions(0, i)) <= 1e-9) half += shares.samples[i] / 2;
  }
  EXPECT_NEAR(half, 0.5, 0.01);
}

TEST(DomainSamples, SurfaceWithoutAreaIsSharedEqually) {
  ControlMesh mesh = OctahedralSphere(0.3, 1);
  mesh.vertices.setZero();
  const auto samples = BuildDomainSamples(mesh, 1, RunContext());
  ASSERT_TRUE(samples.ok());
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(*samples, mesh.vertices, RunContext(), &surface).ok());
  EXPECT_TRUE(surface.normals.isZero());
  for (double share : ShareArea(*samples, surface).samples) {
    EXPECT_DOUBLE_EQ(share, 1.0 / samples->size());
  }
}

TEST(DomainSamples, RefusesWhatIsNoManifold) {
  ControlMesh mesh = OctahedralSphere(0.3, 1);
  mesh.faces.col(0).swap(mesh.faces.col(1));
  std::swap(mesh.faces(0, 0), mesh.faces(1, 0));
  EXPECT_EQ(BuildDomainSamples(mesh, 1, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
