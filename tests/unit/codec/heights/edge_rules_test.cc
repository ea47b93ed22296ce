#include "core/codec/heights/edge_rules.h"

#include "core/loop/refinement.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

TEST(EdgeRulesTest, WeightsSumToOne) {
  for (const EdgeRule& rule : kEdgeRules) {
    EXPECT_EQ(2 * rule.ends + 2 * rule.opposite + 4 * rule.wings, 32);
  }
}

// Over a sheet of squares cut in two, linear heights are met by every rule and cubic ones by the
// butterfly (Dyn, Levin, Gregory 1990).
TEST(EdgeRulesTest, ButterflyMeetsCubics) {
  const MeshTopology topology = *BuildMeshTopology(Sheet(9, 9, false).faces, 81);
  std::vector<double> linear(81), cubic(81);
  const auto curve = [](double x, double y) { return x * x * x - 2 * x * y * y + y * y - 3 * x; };
  for (int v = 0; v < 81; ++v) {
    linear[v] = 2.0 * (v / 9) - 3.0 * (v % 9) + 1;
    cubic[v] = curve(v / 9, v % 9);
  }
  int complete = 0;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const EdgeStencil stencil = StencilOfEdge(topology, e);
    const double x = (stencil.ends[0] / 9 + stencil.ends[1] / 9) / 2.0;
    const double y = (stencil.ends[0] % 9 + stencil.ends[1] % 9) / 2.0;
    for (const EdgeRule& rule : kEdgeRules) {
      const double predicted = WeightedSum(RuleAt(rule, stencil), stencil, linear) / 32;
      EXPECT_NEAR(predicted, 2 * x - 3 * y + 1, 1e-12);
    }
    if (!stencil.complete()) {
      EXPECT_EQ(RuleAt(kEdgeRules[1], stencil).wings, 0);
      continue;
    }
    ++complete;
    EXPECT_NEAR(WeightedSum(kEdgeRules[1], stencil, cubic) / 32, curve(x, y), 1e-9);
  }
  EXPECT_GT(complete, 100);
}

}  // namespace
}  // namespace rilievo
