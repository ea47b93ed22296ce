#include "core/codec/heights/height_layer.h"

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kLayerLevels = 3;

LoopRefinement Refinement(const ControlMesh& mesh) {
  return *RefineTopology(*CanonicalControlMesh(mesh), kLayerLevels, RunContext());
}

// Heights of all levels, vertex by vertex.
GridHeights Field(const LoopRefinement& refinement, int32_t amplitude) {
  GridHeights field;
  for (int v = 0; v < refinement.levels[kLayerLevels].vertex_count; ++v) {
    field.heights.push_back(static_cast<int32_t>(amplitude * MixedUnit(v)));
    field.sources.push_back(static_cast<HeightSource>(MixedBits(v + 1000000) % 3));
  }
  return field;
}

std::vector<std::vector<uint8_t>> EncodeLevels(const LoopRefinement& refinement,
                                               GridHeights& field) {
  std::vector<std::vector<uint8_t>> layers;
  for (int level = 0; level <= kLayerLevels; ++level) {
    layers.push_back(
        EncodeHeightLayer(refinement.levels[std::max(0, level - 1)], level == 0, field));
  }
  return layers;
}

TEST(HeightLayerTest, RoundTripsEveryAmplitude) {
  for (const ControlMesh& mesh : {Octahedron(), Sheet(5, 6, true)}) {
    const LoopRefinement refinement = Refinement(mesh);
    for (int32_t amplitude : {0, 1, 2, 10, 1000, kMaxHeightSteps}) {
      GridHeights field = Field(refinement, amplitude);
      const auto layers = EncodeLevels(refinement, field);
      GridHeights decoded;
      for (int level = 0; level <= kLayerLevels; ++level) {
        const absl::Status status = DecodeHeightLayer(
            layers[level], refinement.levels[std::max(0, level - 1)], level == 0, decoded);
        ASSERT_TRUE(status.ok()) << status;
        EXPECT_EQ(static_cast<int>(decoded.heights.size()), refinement.levels[level].vertex_count);
      }
      EXPECT_EQ(decoded.heights, field.heights);
      EXPECT_EQ(decoded.sources, field.sources);
      EXPECT_EQ(decoded.residuals, field.residuals);
    }
  }
}

// White noise in [-50, 50] has log2(101) bits a height, its sources log2(3). Predicting it from the
// mean of two neighbours makes the variance half as large again: half a bit, and learning costs
// too.
TEST(HeightLayerTest, NoiseCostsLittleMoreThanItsEntropy) {
  const LoopRefinement refinement = Refinement(Torus(16, 12));
  GridHeights field = Field(refinement, 50);
  const auto layers = EncodeLevels(refinement, field);
  const double heights = refinement.levels[kLayerLevels - 1].edge_count();
  const double bits = 8.0 * layers[kLayerLevels].size() / heights;
  EXPECT_LT(bits, std::log2(101) + std::log2(3) + 0.65);
  EXPECT_GT(bits, std::log2(101) + std::log2(3) - 0.05);
}

// The butterfly foresees a smooth field but for a step or so; linear prediction does not.
TEST(HeightLayerTest, SmoothFieldsCostLittle) {
  const ControlMesh mesh = *CanonicalControlMesh(Torus(16, 12));
  const LoopRefinement refinement = *RefineTopology(mesh, kLayerLevels, RunContext());
  const LimitSurface limit = *EvaluateLimit(refinement, mesh.vertices, kLayerLevels, RunContext());
  GridHeights field;
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    field.heights.push_back(static_cast<int32_t>(1000 * std::sin(4 * limit.positions(0, v)) *
                                                 std::cos(5 * limit.positions(2, v))));
    field.sources.push_back(HeightSource::kMeasured);
  }
  const auto layers = EncodeLevels(refinement, field);
  EXPECT_EQ(layers[kLayerLevels][0], 1);  // the butterfly
  EXPECT_LT(8.0 * layers[kLayerLevels].size() / refinement.levels[kLayerLevels - 1].edge_count(),
            1.7);
}

TEST(HeightLayerTest, RefusesWhatIsCutOrUnknown) {
  const LoopRefinement refinement = Refinement(Torus(9, 7));
  GridHeights field = Field(refinement, 100);
  std::vector<uint8_t> layer = EncodeHeightLayer(refinement.levels[0], true, field);
  for (size_t size : {size_t{0}, size_t{1}, layer.size() / 2}) {
    GridHeights decoded;
    EXPECT_EQ(
        DecodeHeightLayer(std::span(layer).first(size), refinement.levels[0], true, decoded).code(),
        absl::StatusCode::kDataLoss);
  }
  layer[0] = 4;
  GridHeights decoded;
  EXPECT_EQ(DecodeHeightLayer(layer, refinement.levels[0], true, decoded).code(),
            absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace rilievo
