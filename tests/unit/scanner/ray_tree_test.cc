#include "tests/scans/ray_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/scans/random.h"
#include "tests/scans/scene_builder.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TriangleMesh Boxes() {
  SceneBuilder builder(0.3);
  builder.AddBox({-1, -1, -1}, {1, 1, 1});
  builder.AddBox({2, -0.5, -0.2}, {2.1, 0.5, 0.7});
  builder.AddPost({-2, 0, 0}, 0.3, 2, 7);
  return builder.Take();
}

Vector3d RandomDirection(Random* random) {
  return Vector3d(random->Normal(), random->Normal(), random->Normal()).normalized();
}

TEST(RayTreeTest, TheWholeTreeFindsWhatEachTriangleAloneShows) {
  const TriangleMesh mesh = Boxes();
  const RayTree tree(mesh);
  std::vector<TriangleMesh> alone;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    alone.push_back({mesh.vertices, mesh.triangles.col(f), {}});
  }
  Random random(3);
  int met = 0;
  for (int i = 0; i < 100; ++i) {
    const Vector3d origin = 4 * RandomDirection(&random);
    const Ray ray{origin, (2 * RandomDirection(&random) - origin).normalized()};
    double nearest = std::numeric_limits<double>::infinity();
    for (const TriangleMesh& triangle : alone) {
      const auto hit = RayTree(triangle).First(ray);
      if (hit) nearest = std::min(nearest, hit->distance);
    }
    const auto hit = tree.First(ray);
    EXPECT_EQ(hit.has_value(), std::isfinite(nearest));
    if (!hit) continue;
    ++met;
    EXPECT_EQ(hit->distance, nearest);
  }
  EXPECT_GT(met, 20);
  EXPECT_LT(met, 100) << "some rays are to miss";
}

TEST(RayTreeTest, ARayAlongAnAxisMeetsTheNearerFaceOfABox) {
  const TriangleMesh mesh = Boxes();
  const auto hit = RayTree(mesh).First({{5, 0.31, 0.17}, {-1, 0, 0}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->distance, 5 - 2.1, 1e-12);
}

}  // namespace
}  // namespace rilievo
