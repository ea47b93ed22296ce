// Heights in, bytes out, and what comes back from them.
#include "core/codec/heights/height_encoder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stop_token>
#include <thread>

#include "core/codec/heights/height_decoder.h"
#include "core/codec/heights/holes.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

DecodedHeights Decode(const EncodedHeights& encoded, const LoopRefinement& refinement,
                      bool has_filled, const FaceGroups* groups = nullptr) {
  std::vector<std::span<const uint8_t>> layers(encoded.layers.begin(), encoded.layers.end());
  auto decoded =
      DecodeHeightLayers(layers, {}, refinement, groups, has_filled, std::nullopt, RunContext());
  EXPECT_TRUE(decoded.ok()) << decoded.status();
  return *std::move(decoded);
}

DisplacedSurface Measured(const ControlMesh& mesh, int max_level, double noise) {
  DisplacedSurface surface = SurfaceOver(mesh, max_level, 1e-4, noise);
  std::fill(surface.sources.begin(), surface.sources.end(), HeightSource::kMeasured);
  return surface;
}

TEST(HeightEncoderTest, DecodesToWithinTheErrorItSays) {
  const DisplacedSurface surface = Measured(Torus(10, 8), 4, 1e-4);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
  const HeightEncoder encoder(surface, refinement, 1);
  const std::vector<double> weights = HeightWeights(surface.control_mesh, refinement, 4,
                                                    std::vector<uint8_t>(surface.heights.size()));
  double last_rms = 0;
  int64_t last_bytes = 1 << 30;
  for (double step : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
    const EncodedHeights encoded = *encoder.Encode(step, RunContext());
    const DecodedHeights decoded = Decode(encoded, refinement, encoder.has_filled());
    double sum = 0, largest = 0;
    for (size_t v = 0; v < surface.heights.size(); ++v) {
      const double error = std::abs(decoded.heights[v] * encoded.unit - surface.heights[v]);
      sum += weights[v] * error * error;
      largest = std::max(largest, error);
    }
    EXPECT_NEAR(encoded.rms, std::sqrt(sum), 1e-9);
    EXPECT_NEAR(encoded.max, largest, 1e-9);
    EXPECT_LT(encoded.rms, 0.5 * step);
    EXPECT_GT(encoded.rms, last_rms);
    EXPECT_LT(encoded.bytes(), last_bytes);
    last_rms = encoded.rms;
    last_bytes = encoded.bytes();
  }
}

// White noise has no structure to win from. An ideal quantiser of independent normal heights takes
// log2(sigma sqrt(2 pi e) / step) bits each at an error of step / sqrt(12); the basis functions are
// not quite orthogonal, which costs some of the rest.
TEST(HeightEncoderTest, NoiseCostsItsEntropy) {
  DisplacedSurface surface = Measured(Torus(12, 10), 4, 0);
  const double sigma = 3e-3, step = 1e-4;
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    double sum = 0;  // of twelve uniform ones in [-1, 1): variance 4
    for (int i = 0; i < 12; ++i) sum += MixedUnit(12 * v + i);
    surface.heights[v] = static_cast<float>(sigma * sum / 2);
  }
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
  const EncodedHeights encoded = *HeightEncoder(surface, refinement, 1).Encode(step, RunContext());
  const double ideal = std::log2(sigma * std::sqrt(2 * std::numbers::pi * std::numbers::e) /
                                 (encoded.rms * std::sqrt(12.0)));
  const double bits = 8.0 * encoded.bytes() / surface.heights.size();
  EXPECT_LT(bits, ideal + 0.25);
  EXPECT_GT(bits, ideal - 0.05);
}

// Flat surfaces cost a byte a level.
TEST(HeightEncoderTest, FlatSurfacesCostNothing) {
  DisplacedSurface surface = Measured(Torus(10, 8), 4, 0);
  std::fill(surface.heights.begin(), surface.heights.end(), 0.0f);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
  const EncodedHeights encoded = *HeightEncoder(surface, refinement, 1).Encode(1e-5, RunContext());
  EXPECT_LE(encoded.bytes(), 5);
  EXPECT_EQ(encoded.rms, 0);
  EXPECT_EQ(Decode(encoded, refinement, false).heights,
            std::vector<int32_t>(surface.heights.size(), 0));
}

std::vector<uint8_t> Rings(const DisplacedSurface& surface, const LoopRefinement& refinement) {
  std::vector<uint8_t> filled;
  for (HeightSource source : surface.sources) filled.push_back(source == HeightSource::kFilled);
  return RingsIntoHoles(refinement, surface.max_level, kRimRings, filled);
}

// What is said of an error is said of told heights alone.
TEST(HeightEncoderTest, SaysTheErrorOfToldHeights) {
  DisplacedSurface surface = SurfaceOver(Torus(14, 10), 4, 1e-4, 1e-4);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    if (surface.sources[v] != HeightSource::kFilled) continue;
    surface.heights[v] += static_cast<float>(2e-3 * MixedUnit(v));
  }
  const std::vector<double> weights = HeightWeights(surface.control_mesh, refinement, 4,
                                                    std::vector<uint8_t>(surface.heights.size()));
  for (const int smallest_hole : {16, 1 << 20}) {
    const HeightEncoder encoder(surface, refinement, smallest_hole);
    ASSERT_EQ(encoder.has_filled(), smallest_hole == 16);
    const EncodedHeights encoded = *encoder.Encode(1e-3, RunContext());
    const DecodedHeights decoded = Decode(encoded, refinement, encoder.has_filled());
    double sum = 0, told = 0, largest = 0;
    for (size_t v = 0; v < surface.heights.size(); ++v) {
      if (surface.sources[v] == HeightSource::kFilled) continue;
      const double error = std::abs(decoded.heights[v] * encoded.unit - surface.heights[v]);
      sum += weights[v] * error * error;
      told += weights[v];
      largest = std::max(largest, error);
    }
    EXPECT_NEAR(encoded.rms, std::sqrt(sum / told), 1e-9);
    EXPECT_NEAR(encoded.max, largest, 1e-9);
  }
}

// Points lie beside the rims of holes: what is filled in there comes back as it was given, bent off
// the told heights too.
TEST(HeightEncoderTest, RimsOfHolesComeBack) {
  DisplacedSurface surface = SurfaceOver(Torus(14, 10), 4, 1e-4, 0);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
  const std::vector<uint8_t> rings = Rings(surface, refinement);
  for (size_t v = 0; v < rings.size(); ++v) {
    surface.heights[v] += static_cast<float>(2e-3 * rings[v]);
  }
  for (const int smallest_hole : {16, 1 << 20}) {
    const HeightEncoder encoder(surface, refinement, smallest_hole);
    ASSERT_EQ(encoder.has_filled(), smallest_hole == 16);
    for (const double step : {1e-3, 1e-4, 1e-5}) {
      const EncodedHeights encoded = *encoder.Encode(step, RunContext());
      const DecodedHeights decoded = Decode(encoded, refinement, encoder.has_filled());
      for (int ring = 1; ring <= kRimRings; ++ring) {
        double sum = 0;
        int count = 0;
        for (size_t v = 0; v < rings.size(); ++v) {
          if (rings[v] != ring) continue;
          sum += std::pow(decoded.heights[v] * encoded.unit - surface.heights[v], 2);
          ++count;
        }
        ASSERT_GT(count, 50);
        EXPECT_LT(std::sqrt(sum / count), step) << ring;
      }
    }
  }
}

// Noise among filled heights far from told ones is no noise of the surface: it costs nothing,
// disturbs nothing, and what is put in its place is smooth.
TEST(HeightEncoderTest, FilledHeightsFarFromToldOnesAreFree) {
  DisplacedSurface surface = SurfaceOver(Torus(14, 10), 4, 1e-4, 0);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 4, RunContext());
  const LoopRefinement lean = *RefineTopology(surface.control_mesh, 3, RunContext());
  for (HeightSource& source : surface.sources) {
    if (source != HeightSource::kFilled) source = HeightSource::kMeasured;
  }
  const std::vector<uint8_t> rings = Rings(surface, lean);
  DisplacedSurface noisy = surface;
  for (size_t v = 0; v < noisy.heights.size(); ++v) {
    if (rings[v] > kRimRings) noisy.heights[v] += static_cast<float>(2e-3 * MixedUnit(v));
  }
  const HeightEncoder encoder(noisy, lean, 16);
  ASSERT_TRUE(encoder.has_filled());
  const EncodedHeights with_noise = *encoder.Encode(1e-4, RunContext());
  const EncodedHeights without = *HeightEncoder(surface, lean, 16).Encode(1e-4, RunContext());
  EXPECT_LT(with_noise.bytes(), 1.15 * without.bytes());
  EXPECT_LT(with_noise.rms, 5e-5);

  const DecodedHeights decoded = Decode(with_noise, lean, true);
  const MeshTopology& finest = refinement.levels[4];
  double roughest = 0, roughest_given = 0, roughest_smooth = 0;
  for (int e = 0; e < finest.edge_count(); ++e) {
    const int a = finest.edge_vertices(0, e), b = finest.edge_vertices(1, e);
    if (rings[a] <= kRimRings || rings[b] <= kRimRings) continue;
    roughest =
        std::max(roughest, std::abs(decoded.heights[a] - decoded.heights[b]) * with_noise.unit);
    roughest_given =
        std::max(roughest_given, double{std::abs(noisy.heights[a] - noisy.heights[b])});
    roughest_smooth =
        std::max(roughest_smooth, double{std::abs(surface.heights[a] - surface.heights[b])});
  }
  EXPECT_GT(roughest_given, 2.5 * roughest_smooth);
  EXPECT_LT(roughest, 1.5 * roughest_smooth);
}

// Rounds of correction take something off the error of even faces, and add little where large faces
// lie beside small ones.
TEST(HeightEncoderTest, CorrectionsDoNotDiverge) {
  constexpr int kRounds = 6;
  for (const double unevenness : {1.0, 8.0, 30.0}) {
    const DisplacedSurface surface = Measured(Uneven(Torus(24, 20), unevenness), 4, 1e-4);
    const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
    const HeightEncoder encoder(surface, refinement, 1);
    for (const double step : {1e-5, 1e-4, 1e-3}) {
      const std::vector<double> rms = *encoder.RmsOfRounds(step, kRounds, RunContext());
      const double most = unevenness == 1 ? 0.995 : 1.15;
      for (int round = 1; round < kRounds; ++round) {
        EXPECT_LT(rms[round], most * rms[0]) << unevenness << ", " << step << ", " << round;
      }
    }
  }
}

// Smooth heights at a hundredth of their own size: far fewer bits than heights.
TEST(HeightEncoderTest, SmoothHeightsTakeAFractionOfABit) {
  const DisplacedSurface surface = Measured(Torus(10, 8), 5, 0);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 4, RunContext());
  const EncodedHeights encoded = *HeightEncoder(surface, refinement, 1).Encode(1e-4, RunContext());
  EXPECT_LT(8.0 * encoded.bytes() / surface.heights.size(), 0.15);
  EXPECT_LT(encoded.rms, 3e-5);
}

// A few measured heights of either sign among filled ones: the filled heights overshoot far, and so
// fine a step leaves the format little room.
TEST(HeightEncoderTest, TheUnitWidensUntilAllHeightsFit) {
  for (const int group_limit : {0, kLeastGroupLimit}) {
    DisplacedSurface surface = SurfaceOver(Torus(10, 8), 6, 1e-4, 0);
    const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 5, RunContext());
    for (size_t v = 0; v < surface.heights.size(); ++v) {
      const bool told = MixedBits(v) % 20000 == 0;
      surface.sources[v] = told ? HeightSource::kMeasured : HeightSource::kFilled;
      surface.heights[v] = MixedBits(7 * v) % 2 == 0 ? 0.4f : -0.4f;
    }
    const std::vector<GridPoint> points(surface.control_mesh.vertices.cols(), GridPoint{});
    FaceGroups groups;
    if (group_limit > 0) groups = GroupFaces(refinement.levels[0], points, group_limit);
    const FaceGroups* coded_apart = group_limit > 0 ? &groups : nullptr;
    const HeightEncoder encoder(surface, refinement, 16, coded_apart);
    const EncodedHeights encoded = *encoder.Encode(1e-8, RunContext());
    const DecodedHeights decoded = Decode(encoded, refinement, encoder.has_filled(), coded_apart);
    double overshoot = 0, error = 0;
    for (size_t v = 0; v < surface.heights.size(); ++v) {
      const double height = decoded.heights[v] * encoded.unit;
      overshoot = std::max(overshoot, std::abs(height));
      if (surface.sources[v] == HeightSource::kFilled) continue;
      error = std::max(error, std::abs(height - surface.heights[v]));
    }
    EXPECT_GT(overshoot, 1.6);  // beyond what the given heights alone would make the unit for
    EXPECT_NEAR(error, encoded.max, 1e-9);
  }
}

TEST(HeightEncoderTest, StopsWhenAsked) {
  const DisplacedSurface surface = Measured(Torus(8, 6), 2, 1e-4);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 1, RunContext());
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(HeightEncoder(surface, refinement, 1).Encode(1e-4, context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(HeightEncoderTest, StopsWhileGroupsAreCoded) {
  const DisplacedSurface surface = Measured(Torus(24, 20), 5, 1e-4);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 4, RunContext());
  const std::vector<GridPoint> points(surface.control_mesh.vertices.cols(), GridPoint{});
  const FaceGroups groups = GroupFaces(refinement.levels[0], points, kLeastGroupLimit);
  ASSERT_GT(groups.count(), 4);
  const HeightEncoder encoder(surface, refinement, 1, &groups);
  std::stop_source source;
  RunContext context;
  context.stop = source.get_token();
  const std::jthread stopper([&source] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    source.request_stop();
  });
  EXPECT_EQ(encoder.Encode(1e-5, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
