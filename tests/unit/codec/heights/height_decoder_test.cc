#include "core/codec/heights/height_decoder.h"

#include "core/codec/heights/height_encoder.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

class HeightDecoderTest : public ::testing::Test {
 protected:
  absl::StatusOr<DecodedHeights> Decode(const std::vector<std::vector<uint8_t>>& layers) const {
    const std::vector<std::span<const uint8_t>> spans(layers.begin(), layers.end());
    return DecodeHeightLayers(spans, {}, refinement_, nullptr, encoder_.has_filled(), std::nullopt,
                              RunContext());
  }

  const DisplacedSurface surface_ = SurfaceOver(Sheet(6, 7, true), 3, 1e-4, 1e-4);
  const LoopRefinement refinement_ = *RefineTopology(surface_.control_mesh, 2, RunContext());
  const HeightEncoder encoder_{surface_, refinement_, 1};
  const std::vector<std::vector<uint8_t>> layers_ = encoder_.Encode(1e-5, RunContext())->layers;
};

TEST_F(HeightDecoderTest, EveryNumberOfLayersIsALevel) {
  for (size_t count = 1; count <= layers_.size(); ++count) {
    const auto decoded = Decode({layers_.begin(), layers_.begin() + count});
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    const size_t vertices = refinement_.vertex_count(static_cast<int>(count) - 1);
    EXPECT_EQ(decoded->heights.size(), vertices);
    EXPECT_EQ(decoded->filled.size(), vertices);
    for (size_t v = 0; v < vertices; ++v) {
      EXPECT_EQ(decoded->filled[v] != 0, surface_.sources[v] == HeightSource::kFilled);
    }
  }
}

TEST_F(HeightDecoderTest, CutLayersAreDataLoss) {
  for (size_t level = 0; level < layers_.size(); ++level) {
    std::vector<std::vector<uint8_t>> cut = layers_;
    for (size_t size : {size_t{0}, size_t{3}, layers_[level].size() / 2}) {
      cut[level].resize(size);
      EXPECT_EQ(Decode(cut).status().code(), absl::StatusCode::kDataLoss) << level << ' ' << size;
      cut[level] = layers_[level];
    }
  }
}

// The largest step of the format takes coefficients out of the range of heights.
TEST_F(HeightDecoderTest, HeightsOutOfRangeAreDataLoss) {
  std::vector<std::vector<uint8_t>> layers = layers_;
  std::vector<uint8_t>& first = layers[0];
  size_t end_of_step = 1;
  while ((first[end_of_step] & 0x80) != 0) ++end_of_step;
  first.erase(first.begin() + 1, first.begin() + end_of_step + 1);
  const uint8_t largest[] = {0x80, 0x80, 0x80, 0x08};  // 2^24
  first.insert(first.begin() + 1, std::begin(largest), std::end(largest));
  EXPECT_EQ(Decode(layers).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace rilievo
