#include "core/displacement/feet/crease_feet.h"

#include <gtest/gtest.h>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

// A sheet with a crease along x = 0, under a sharp line that rises along it.
TEST(AppendCreaseFeet, EachVertexOfACreaseIsAsHighAsTheLineAboveIt) {
  ControlMesh mesh = Sheet(0.3, 4);
  for (int y = 0; y < 4; ++y)
    mesh.creases.push_back({5 * y + 2, 5 * (y + 1) + 2, kInfiniteSharpness});
  const Domain domain = MakeDomain(mesh, 3);
  OrientedCloud cloud;
  cloud.sharp_lines.resize(3, 2);
  cloud.sharp_lines << 0, 0, -0.5, 0.5, 0.01, 0.03;
  std::vector<PointFoot> feet(1);  // that of a point
  ASSERT_TRUE(
      AppendCreaseFeet(cloud, domain.refinement, domain.rings, domain.limit, Threads(2), &feet)
          .ok());
  std::vector<int> told(domain.size(), 0);
  for (size_t i = 1; i < feet.size(); ++i) {
    const int v = feet[i].corner[0];
    ++told[v];
    EXPECT_FLOAT_EQ(feet[i].weight[0], 1);
    EXPECT_EQ(feet[i].weight[1], 0);
    EXPECT_EQ(feet[i].weight[2], 0);
    const double y = domain.limit.positions(1, v);
    EXPECT_NEAR(feet[i].offset, 0.02 + 0.02 * y, 2e-5);  // the line's slope turns the way to it
  }
  for (int v = 0; v < domain.size(); ++v) {
    const bool on_crease = std::abs(domain.limit.positions(0, v)) < 1e-9;
    EXPECT_EQ(told[v], on_crease ? 1 : 0) << v;
  }
}

TEST(AppendCreaseFeet, WithoutLinesThereAreNone) {
  ControlMesh mesh = Sheet(0.3, 4);
  mesh.creases.push_back({7, 12, kInfiniteSharpness});
  const Domain domain = MakeDomain(mesh, 2);
  std::vector<PointFoot> feet;
  ASSERT_TRUE(AppendCreaseFeet(OrientedCloud(), domain.refinement, domain.rings, domain.limit,
                               Threads(2), &feet)
                  .ok());
  EXPECT_TRUE(feet.empty());
}

}  // namespace
}  // namespace rilievo
