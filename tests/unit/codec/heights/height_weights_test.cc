#include "core/codec/heights/height_weights.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kWeightLevels = 4;

TEST(HeightWeightsTest, ShareTheArea) {
  const ControlMesh mesh = Sheet(5, 6, false);
  const LoopRefinement refinement = *RefineTopology(mesh, kWeightLevels - 1, RunContext());
  const int count = refinement.vertex_count(kWeightLevels);
  const std::vector<uint8_t> none(count, 0);
  const std::vector<double> weights = HeightWeights(mesh, refinement, kWeightLevels, none);
  ASSERT_EQ(static_cast<int>(weights.size()), count);
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1, 1e-12);
  EXPECT_GT(*std::min_element(weights.begin(), weights.end()), 0);
  std::vector<uint8_t> half(count, 0);
  for (int v = 0; v < count; v += 2) half[v] = kRimRings + 1;
  const std::vector<double> left = HeightWeights(mesh, refinement, kWeightLevels, half);
  EXPECT_NEAR(std::accumulate(left.begin(), left.end(), 0.0), 1, 1e-12);
  for (int v = 0; v < count; ++v) EXPECT_EQ(left[v] == 0, v % 2 == 0);
  const std::vector<double> nothing =
      HeightWeights(mesh, refinement, kWeightLevels, std::vector<uint8_t>(count, kRimRings + 1));
  EXPECT_EQ(*std::max_element(nothing.begin(), nothing.end()), 0);
  // Rims of holes count less.
  std::vector<uint8_t> rim(count, 0);
  rim[0] = 1;
  rim[1] = kRimRings;
  const std::vector<double> less = HeightWeights(mesh, refinement, kWeightLevels, rim);
  for (int v : {0, 1}) {
    EXPECT_NEAR(less[v] / less[2], kRimShare * weights[v] / weights[2], 1e-12);
  }
}

// Two triangles: each vertex has a third of its faces, or a quarter of the mean.
TEST(HeightWeightsTest, LevelZeroIsAThirdOfTheFaces) {
  ControlMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 0, 3, 0, 0, 1, 3, 0, 0, 0, 0;
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 1, 1, 3, 2, 2;
  const LoopRefinement refinement = *RefineTopology(mesh, 0, RunContext());
  const auto expect = [&](double far, double small, double large, double least) {
    mesh.vertices.col(3) << far, far, 0;
    const std::vector<double> weights = HeightWeights(mesh, refinement, 0, {0, 0, 0, 0});
    const double sum = std::max(small, least) + 2 * (small + large) + large;
    EXPECT_NEAR(weights[0], std::max(small, least) / sum, 1e-12);
    EXPECT_NEAR(weights[1], (small + large) / sum, 1e-12);
    EXPECT_NEAR(weights[3], large / sum, 1e-12);
  };
  expect(2, 0.5, 1.5, 0);                     // areas 1/2 and (2 far - 1) / 2
  expect(20, 0.5, 19.5, (3 * 20.0) / 4 / 4);  // mean of 0.5, 20, 20, 19.5
}

// The gain of a level is the mean squared norm of its basis functions, here counted one by one.
TEST(HeightWeightsTest, GainsAreNormsOfBasisFunctions) {
  const ControlMesh mesh = Torus(12, 10);
  const LoopRefinement refinement = *RefineTopology(mesh, kWeightLevels - 1, RunContext());
  HeightLifting lifting(refinement, kWeightLevels);
  const int count = refinement.vertex_count(kWeightLevels);
  const std::vector<double> even(count, 1.0 / count);
  const CoefficientGains gains = GainsOf(lifting, refinement, even);
  for (int l = 0; l <= kWeightLevels; ++l) {
    double sum = 0;
    const int step = std::max(1, (lifting.end(l) - lifting.begin(l)) / 40);
    int functions = 0;
    for (int v = lifting.begin(l); v < lifting.end(l); v += step, ++functions) {
      std::vector<double> basis(count, 0.0);
      basis[v] = 1;
      lifting.Synthesize(basis);
      for (double value : basis) sum += value * value / count;
    }
    const double expected = sum / functions;
    EXPECT_NEAR(gains.of_level[l] / count / expected, 1, 0.12) << l;
    EXPECT_NEAR(gains.of_vertex[lifting.begin(l)] / expected, 1, 0.12) << l;
    // Each level's functions have four times the vertices of the next one's. Not so at the finest,
    // where one vertex is all there is of a detail.
    if (l > 1 && l < kWeightLevels) {
      EXPECT_NEAR(gains.of_level[l - 1] / gains.of_level[l], 4, 0.8);
    }
  }
}

// What the gains are for: errors of all coefficients at once add up to the sum of theirs.
TEST(HeightWeightsTest, ErrorsAddUpAsPredicted) {
  const ControlMesh mesh = Torus(16, 12);
  const LoopRefinement refinement = *RefineTopology(mesh, kWeightLevels - 1, RunContext());
  HeightLifting lifting(refinement, kWeightLevels);
  const int count = refinement.vertex_count(kWeightLevels);
  const std::vector<uint8_t> none(count, 0);
  const std::vector<double> weights = HeightWeights(mesh, refinement, kWeightLevels, none);
  const CoefficientGains gains = GainsOf(lifting, refinement, weights);
  std::vector<double> error(count);
  double predicted = 0;
  for (int v = 0; v < count; ++v) {
    error[v] = MixedUnit(v) / std::sqrt(gains.of_vertex[v]);
    predicted += gains.of_vertex[v] * error[v] * error[v];
  }
  lifting.Synthesize(error);
  double made = 0;
  for (int v = 0; v < count; ++v) made += weights[v] * error[v] * error[v];
  EXPECT_NEAR(made / predicted, 1, 0.1);
}

}  // namespace
}  // namespace rilievo
