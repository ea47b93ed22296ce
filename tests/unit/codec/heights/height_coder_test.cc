#include "core/codec/heights/height_coder.h"

#include <algorithm>

#include "core/codec/bytes/range_coder.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kLevels = 3;

// Codes given numbers; blocks are active where they hold any.
class GivenNumbers {
 public:
  GivenNumbers(const LoopRefinement& refinement, int level, const std::vector<int32_t>& numbers)
      : numbers_(numbers) {
    if (level < 2) return;
    const MeshTopology& topology = refinement.levels[level - 1];
    for (int j = 0; j <= level - 2; ++j) {
      active_.emplace_back(refinement.levels[j].face_count(), 0);
      for (int e = 0; e < topology.edge_count(); ++e) {
        if (numbers[topology.vertex_count + e] == 0) continue;
        active_[j][topology.edge_faces(0, e) >> 2 * (level - 1 - j)] = 1;
      }
    }
  }
  bool Active(int j, int f) const { return active_[j][f] != 0; }
  int32_t Choose(int v, HeightModels::Coefficients&,
                 const HeightModels::Coefficients::Contexts&) const {
    return numbers_[v];
  }

 private:
  const std::vector<int32_t>& numbers_;
  std::vector<std::vector<uint8_t>> active_;
};

// Heights do not matter for the round trip, but both sides have to have the same.
void PutHeights(const LoopRefinement& refinement, int level, HeightState& state) {
  state.heights.clear();
  for (int v = 0; v < refinement.vertex_count(level); ++v) {
    state.heights.push_back(static_cast<int32_t>(MixedBits(v) % 1000));
  }
}

struct Layers {
  std::vector<std::vector<uint8_t>> bytes;
};

Layers Encode(const LoopRefinement& refinement, const std::vector<int32_t>& numbers,
              const std::vector<uint8_t>& filled, bool has_filled) {
  Layers layers;
  HeightModels models;
  HeightState state;
  state.filled = filled;
  for (int level = 0; level <= kLevels; ++level) {
    RangeEncoder coder;
    GivenNumbers chooser(refinement, level, numbers);
    LevelCoder<RangeEncoder, GivenNumbers> coded(coder, chooser, refinement, level, 100, has_filled,
                                                 models, state);
    EXPECT_TRUE(coded.Run(false));
    PutHeights(refinement, level, state);
    layers.bytes.push_back(coder.Finish());
  }
  return layers;
}

HeightState Decode(const LoopRefinement& refinement, const Layers& layers, bool has_filled) {
  HeightModels models;
  HeightState state;
  NoChoice chooser;
  for (int level = 0; level <= kLevels; ++level) {
    RangeDecoder coder(layers.bytes[level]);
    LevelCoder<RangeDecoder, NoChoice> coded(coder, chooser, refinement, level, 100, has_filled,
                                             models, state);
    EXPECT_TRUE(coded.Run(false));
    EXPECT_FALSE(coder.overrun());
    PutHeights(refinement, level, state);
  }
  return state;
}

TEST(HeightCoderTest, RoundTripsSparseAndDenseNumbers) {
  for (const ControlMesh& mesh : {Octahedron(), Sheet(5, 6, true), Torus(7, 5)}) {
    const LoopRefinement refinement = *RefineTopology(mesh, kLevels - 1, RunContext());
    const int count = refinement.vertex_count(kLevels);
    for (int one_in : {1, 3, 100, 1 << 30}) {
      for (int32_t largest : {1, 50, kMaxCoefficient}) {
        std::vector<int32_t> numbers(count, 0);
        std::vector<uint8_t> filled(count, 0);
        for (int v = 0; v < count; ++v) {
          filled[v] = v % 40 < 8 && one_in < 100;
          if (MixedBits(3 * v) % one_in == 0) {
            numbers[v] = static_cast<int32_t>(largest * MixedUnit(3 * v + 1));
          }
        }
        const Layers layers = Encode(refinement, numbers, filled, one_in < 100);
        const HeightState decoded = Decode(refinement, layers, one_in < 100);
        EXPECT_EQ(decoded.coefficients, numbers);
        EXPECT_EQ(decoded.filled, filled);
      }
    }
  }
}

// Zeros cost next to nothing: blocks of them are skipped.
TEST(HeightCoderTest, EmptyBlocksAreNearlyFree) {
  const LoopRefinement refinement = *RefineTopology(Torus(40, 32), kLevels - 1, RunContext());
  const int count = refinement.vertex_count(kLevels);
  std::vector<int32_t> numbers(count, 0);
  // Only the first eighth of the finest level has any.
  const int begin = refinement.vertex_count(kLevels - 1);
  for (int v = begin; v < begin + (count - begin) / 8; ++v) {
    numbers[v] = static_cast<int32_t>(MixedBits(v) % 3) - 1;
  }
  const Layers layers = Encode(refinement, numbers, std::vector<uint8_t>(count, 0), false);
  // log2(3) bits each, and at most a tenth more for the rest.
  EXPECT_LT(8.0 * layers.bytes[kLevels].size(), 1.1 * 1.585 * (count - begin) / 8);
}

TEST(HeightCoderTest, NumbersOutOfRangeAreNoticed) {
  const LoopRefinement refinement = *RefineTopology(Octahedron(), kLevels - 1, RunContext());
  std::vector<int32_t> numbers(refinement.vertex_count(0), 0);
  numbers[3] = kMaxCoefficient + 1;
  RangeEncoder encoder;
  GivenNumbers chooser(refinement, 0, numbers);
  HeightModels models;
  HeightState state;
  LevelCoder<RangeEncoder, GivenNumbers> coded(encoder, chooser, refinement, 0, 100, false, models,
                                               state);
  EXPECT_FALSE(coded.Run(false));
}

TEST(HeightCoderTest, EmptyLayersHaveFlagsOnly) {
  const LoopRefinement refinement = *RefineTopology(Octahedron(), kLevels - 1, RunContext());
  RangeEncoder encoder;
  NoChoice chooser;
  HeightModels models;
  HeightState state;
  state.filled.assign(refinement.vertex_count(0), 1);
  LevelCoder<RangeEncoder, NoChoice> coded(encoder, chooser, refinement, 0, 1, true, models, state);
  EXPECT_TRUE(coded.Run(true));
  EXPECT_EQ(std::count(state.coefficients.begin(), state.coefficients.end(), 0), 6);
  const std::vector<uint8_t> bytes = encoder.Finish();
  RangeDecoder decoder(bytes);
  HeightModels read_models;
  HeightState read;
  LevelCoder<RangeDecoder, NoChoice> reader(decoder, chooser, refinement, 0, 1, true, read_models,
                                            read);
  EXPECT_TRUE(reader.Run(true));
  EXPECT_EQ(read.filled, state.filled);
}

}  // namespace
}  // namespace rilievo
