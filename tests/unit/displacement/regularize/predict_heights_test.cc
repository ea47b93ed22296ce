#include "core/displacement/regularize/predict_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

struct ForetellTest : ::testing::Test {
  Domain domain = MakeDomain(Sheet(0.4, 8), 3);
  HeightSamples samples{static_cast<size_t>(domain.size())};

  void Set(const std::function<double(double, double)>& height) {
    for (int v = 0; v < domain.size(); ++v) {
      samples.height[v] =
          static_cast<float>(height(domain.limit.positions(0, v), domain.limit.positions(1, v)));
      samples.measured[v] = 1;
      samples.deviation[v] = 1e-5f;
    }
  }
  bool FarFromBorder(int vertex, double margin) const {
    return domain.limit.positions.col(vertex).head<2>().cwiseAbs().maxCoeff() < 0.4 - margin;
  }
};

TEST_F(ForetellTest, CubicsAreForetoldExactly) {
  const auto cubic = [](double x, double y) {
    return 0.02 + 0.1 * x - 0.3 * x * y + 0.2 * y * y + 0.7 * x * x * y - 0.4 * y * y * y;
  };
  Set(cubic);
  const MeshTopology& coarser = domain.refinement.levels[2];
  int predicted = 0;
  for (int edge = 0; edge < coarser.edge_count(); ++edge) {
    const int vertex = coarser.vertex_count + edge;
    const auto height = PredictHeight(coarser, edge, samples);
    if (!FarFromBorder(vertex, 0.11)) continue;
    ASSERT_TRUE(height);
    ASSERT_NEAR(*height, samples.height[vertex], 1e-7);
    ++predicted;
  }
  EXPECT_GT(predicted, 500);
}

TEST_F(ForetellTest, NothingAtTheBorderOrBesideAGap) {
  Set([](double, double) { return 0.01; });
  const MeshTopology& coarser = domain.refinement.levels[2];
  const auto lacking = [&] {
    int count = 0;
    for (int edge = 0; edge < coarser.edge_count(); ++edge) {
      count += PredictHeight(coarser, edge, samples) ? 0 : 1;
    }
    return count;
  };
  const int at_border = lacking();
  EXPECT_GE(at_border, 4 * 32);  // the edges of the border at least
  int middle = 0;
  while (domain.limit.positions.col(middle).norm() > 1e-9) ++middle;
  samples.measured[middle] = 0;
  // Its six edges, the six of its ring, and the twelve whose wings it is.
  EXPECT_EQ(lacking(), at_border + 24);
}

TEST_F(ForetellTest, RoughIsWhereTheHeightsDepart) {
  const auto height_field = [](double x, double y) { return 0.1 * x * x - 0.2 * x * y; };
  const auto bump = [&](double x, double y) {
    return height_field(x, y) + 0.002 * std::exp(-(x * x + y * y) / (2 * 0.02 * 0.02));
  };
  Set(height_field);
  const std::vector<uint8_t> smooth = PredictionFailures(domain.refinement, 2, 2, samples);
  Set(bump);
  const std::vector<uint8_t> bumpy = PredictionFailures(domain.refinement, 2, 2, samples);
  for (int v = 0; v < domain.refinement.levels[2].vertex_count; ++v) {
    if (!FarFromBorder(v, 0.15)) continue;
    const double distance = domain.limit.positions.col(v).norm();
    EXPECT_EQ(smooth[v], 0);
    if (distance < 0.04 || distance > 0.2) {
      EXPECT_EQ(bumpy[v], distance < 0.04 ? 1 : 0) << distance;
    }
  }
  const std::vector<uint8_t> coarsest = PredictionFailures(domain.refinement, 0, 2, samples);
  EXPECT_EQ(std::count(coarsest.begin(), coarsest.end(), 1),
            domain.refinement.levels[0].vertex_count);
}

}  // namespace
}  // namespace rilievo
