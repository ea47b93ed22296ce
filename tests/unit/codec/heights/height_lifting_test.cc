#include "core/codec/heights/height_lifting.h"

#include <cmath>
#include <numeric>

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kLiftingLevels = 4;

LoopRefinement Refined(const ControlMesh& mesh) {
  return *RefineTopology(mesh, kLiftingLevels - 1, RunContext());
}

std::vector<double> Noise(int count, uint64_t seed) {
  std::vector<double> values(count);
  for (int v = 0; v < count; ++v) values[v] = MixedUnit(seed * 1000003 + v);
  return values;
}

double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

TEST(HeightLiftingTest, SynthesisUndoesAnalysis) {
  for (const ControlMesh& mesh : {Octahedron(), Sheet(5, 6, true), Torus(7, 5)}) {
    const LoopRefinement refinement = Refined(mesh);
    HeightLifting lifting(refinement, kLiftingLevels);
    const std::vector<double> heights = Noise(refinement.vertex_count(kLiftingLevels), 1);
    std::vector<double> values = heights;
    lifting.AnalyzeAndChoose(std::vector<double>(heights.size(), 1.0), values);
    std::vector<double> again = heights;
    lifting.Analyze(again);
    EXPECT_EQ(again, values);
    lifting.Synthesize(values);
    for (size_t v = 0; v < heights.size(); ++v) EXPECT_NEAR(values[v], heights[v], 1e-12);
  }
}

// <S x, y> = <x, S^T y>, whatever the rule.
TEST(HeightLiftingTest, AdjointIsTheTranspose) {
  for (const ControlMesh& mesh : {Octahedron(), Sheet(5, 6, true), Torus(7, 5)}) {
    const LoopRefinement refinement = Refined(mesh);
    HeightLifting lifting(refinement, kLiftingLevels);
    const int count = refinement.vertex_count(kLiftingLevels);
    for (int rule = 0; rule < static_cast<int>(kEdgeRules.size()); ++rule) {
      lifting.set_steps(std::vector<LiftingStep>(kLiftingLevels, LiftingStep{rule, 8}));
      const std::vector<double> x = Noise(count, 3), y = Noise(count, 4);
      std::vector<double> sx = x, sty = y;
      lifting.Synthesize(sx);
      lifting.Adjoint(sty);
      EXPECT_NEAR(Dot(sx, y), Dot(x, sty), 1e-9) << rule;
    }
  }
}

// The decoder's integers round by half a unit a level, over open and closed meshes, whatever the
// rule.
TEST(HeightLiftingTest, IntegersFollowTheReals) {
  for (const ControlMesh& mesh : {Sheet(6, 7, true), Torus(7, 5), Octahedron()}) {
    const LoopRefinement refinement = Refined(mesh);
    for (int rule = 0; rule < static_cast<int>(kEdgeRules.size()); ++rule) {
      // Heights that this rule foretells are those for which it is chosen.
      std::vector<int32_t> foretold;
      for (int l = 0; l <= kLiftingLevels; ++l) {
        foretold.resize(refinement.vertex_count(l), 0);
        for (int v = 0; l == 0 && v < refinement.vertex_count(0); ++v) {
          foretold[v] = static_cast<int32_t>(1000000 * MixedUnit(v));
        }
        if (l > 0) SynthesizeLevel(refinement.levels[l - 1], {rule, 0}, foretold);
      }
      HeightLifting lifting(refinement, kLiftingLevels);
      lifting.set_strength(0);
      std::vector<double> reals(foretold.begin(), foretold.end());
      lifting.AnalyzeAndChoose(std::vector<double>(reals.size(), 1.0), reals);
      lifting.set_strength(8);
      std::vector<int32_t> integers;
      for (int l = 0; l <= kLiftingLevels; ++l) {
        integers.resize(lifting.end(l));
        for (int v = lifting.begin(l); v < lifting.end(l); ++v) {
          integers[v] = static_cast<int32_t>(MixedBits(v) % 20001) - 10000;
          reals[v] = integers[v];
        }
        if (l == 0) continue;
        EXPECT_EQ(lifting.step(l).rule, rule);
        SynthesizeLevel(refinement.levels[l - 1], lifting.step(l), integers);
      }
      lifting.Synthesize(reals);
      for (size_t v = 0; v < reals.size(); ++v) ASSERT_NEAR(integers[v], reals[v], 4) << v;
    }
  }
}

TEST(HeightLiftingTest, ConstantsHaveNoDetails) {
  const LoopRefinement refinement = Refined(Sheet(5, 6, true));
  HeightLifting lifting(refinement, kLiftingLevels);
  std::vector<double> values(refinement.vertex_count(kLiftingLevels), 0.75);
  lifting.Analyze(values);
  for (int v = 0; v < lifting.end(kLiftingLevels); ++v) {
    EXPECT_NEAR(values[v], v < lifting.end(0) ? 0.75 : 0, 1e-12);
  }
}

// On a torus every vertex stands for the same share of the surface: details add nothing to the
// mean at any level, and the averages keep it.
TEST(HeightLiftingTest, DetailsHaveNoMean) {
  const LoopRefinement refinement = Refined(Torus(8, 6));
  HeightLifting lifting(refinement, kLiftingLevels);
  const int count = refinement.vertex_count(kLiftingLevels);
  for (int l = 1; l <= kLiftingLevels; ++l) {
    std::vector<double> values(count, 0.0);
    for (int v = lifting.begin(l); v < lifting.end(l); ++v) values[v] = 1 + MixedUnit(v);
    lifting.Synthesize(values);
    EXPECT_NEAR(std::accumulate(values.begin(), values.end(), 0.0) / count, 0, 1e-3);
  }
  std::vector<double> heights = Noise(count, 5);
  const double mean = std::accumulate(heights.begin(), heights.end(), 0.0) / count;
  lifting.Analyze(heights);
  const double coarse = std::accumulate(heights.begin(), heights.begin() + lifting.end(0), 0.0);
  EXPECT_NEAR(coarse / lifting.end(0), mean, 1e-3);
}

// Smooth heights choose the butterfly, heights of an edge rule's own making choose that rule.
TEST(HeightLiftingTest, ChoosesTheRuleThatFits) {
  const LoopRefinement refinement = Refined(Torus(10, 8));
  for (int rule : {0, 3}) {
    std::vector<int32_t> heights;
    HeightLifting lifting(refinement, kLiftingLevels);
    for (int l = 0; l <= kLiftingLevels; ++l) {
      heights.resize(lifting.end(l), 0);
      if (l == 0) {
        for (int v = 0; v < lifting.end(0); ++v) heights[v] = MixedBits(v) % 100000;
      } else {
        SynthesizeLevel(refinement.levels[l - 1], {rule, 0}, heights);
      }
    }
    std::vector<double> values(heights.begin(), heights.end());
    lifting.set_strength(0);
    lifting.AnalyzeAndChoose(std::vector<double>(values.size(), 1.0), values);
    for (int l = 1; l <= kLiftingLevels; ++l) EXPECT_EQ(lifting.step(l).rule, rule) << l;
  }
}

}  // namespace
}  // namespace rilievo
