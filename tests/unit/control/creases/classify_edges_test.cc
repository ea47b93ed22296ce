#include "core/control/creases/classify_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/scans/random.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

const Vector3d kHalf(0.32, 0.28, 0.24);

struct JudgedBox : ::testing::Test {
  OrientedCloud cloud = BoxCloud(kHalf, 20'000);
  PointIndex index{cloud.points};
  ControlMesh mesh = BoxMesh(kHalf, 0.08);
  MeshTopology topology = *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));

  bool OnBoxEdge(int edge) const {
    const Vector3d middle = (mesh.vertices.col(topology.edge_vertices(0, edge)) +
                             mesh.vertices.col(topology.edge_vertices(1, edge))) /
                            2;
    int sides = 0;
    for (int axis = 0; axis < 3; ++axis) {
      sides += std::abs(std::abs(middle[axis]) - kHalf[axis]) < 1e-9;
    }
    return sides == 2;
  }
};

TEST_F(JudgedBox, ItsEdgesAreSharpAndItsSidesAreNotEvenLookedAt) {
  const auto judged = ClassifyEdges(cloud, index, mesh, topology, RunContext());
  ASSERT_TRUE(judged.ok()) << judged.status();
  int sharp = 0, strong = 0;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const EdgeClassification& judgement = (*judged)[e];
    if (!OnBoxEdge(e)) {
      EXPECT_EQ(judgement.edge_class, EdgeClass::kSmooth);
      EXPECT_FALSE(judgement.planes) << "its faces are flat";
      continue;
    }
    ++sharp;
    strong += judgement.edge_class == EdgeClass::kStrong;
    ASSERT_TRUE(judgement.planes);
    EXPECT_NEAR(judgement.planes->cosine, 0, 1e-6);
  }
  EXPECT_GT(sharp, 80);
  EXPECT_GT(strong, sharp * 95 / 100);
}

// The same box with edges rounded to arcs of two spacings, under noise.
TEST_F(JudgedBox, RoundedEdgesSpeakLessForThemselves) {
  const double radius = 2 * cloud.median_spacing, noise = 0.3 * cloud.median_spacing;
  Random random(3);
  const auto count_strong = [&](bool rounded) {
    OrientedCloud noisy = cloud;
    for (int64_t i = 0; i < noisy.points.cols(); ++i) {
      Vector3d at = noisy.points.col(i), normal = noisy.normals.col(i);
      if (rounded) {
        const Vector3d most = kHalf - Vector3d::Constant(radius);
        const Vector3d inner = at.cwiseMin(most).cwiseMax(-most);
        normal = (at - inner).normalized();
        at = inner + radius * normal;
      }
      noisy.points.col(i) = at + noise * random.Normal() * normal;
      noisy.normals.col(i) = normal;
    }
    noisy.noise.assign(noisy.noise.size(), static_cast<float>(noise));
    const PointIndex noisy_index(noisy.points);
    const auto judged = ClassifyEdges(noisy, noisy_index, mesh, topology, RunContext());
    EXPECT_TRUE(judged.ok());
    return std::count_if(judged->begin(), judged->end(), [](const EdgeClassification& judgement) {
      return judgement.edge_class == EdgeClass::kStrong;
    });
  };
  const auto sharp = count_strong(false), rounded = count_strong(true);
  EXPECT_GT(sharp, 60);
  EXPECT_LT(rounded, 2 * sharp / 3);
}

TEST_F(JudgedBox, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_EQ(ClassifyEdges(cloud, index, mesh, topology, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
