#include "core/codec/container/colors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>

#include "core/base/run_context.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/decode_region.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

enum class Paint { kSmooth, kChecker };

// A colour of the limit position: a gradient with a hue that turns, or squares of `size`.
Rgb ColorAt(const Eigen::Vector3d& p, Paint paint, double size) {
  if (paint == Paint::kChecker) {
    const int square = static_cast<int>(std::floor(p[0] / size) + std::floor(p[1] / size) +
                                        std::floor(p[2] / size));
    return square % 2 == 0 ? Rgb{220, 60, 40} : Rgb{30, 70, 160};
  }
  const auto wave = [](double x) { return static_cast<uint8_t>(std::lround(128 + 100 * x)); };
  return {wave(std::sin(5 * p[0])), wave(std::cos(4 * p[1] + 1)), wave(std::sin(6 * p[2] + 2))};
}

DisplacedSurface Painted(const ControlMesh& mesh, int level, Paint paint, double size = 0.05) {
  DisplacedSurface surface = SurfaceOver(mesh, level, kPositionStep, 1e-4);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, level, RunContext());
  const LimitSurface limit =
      *EvaluateLimit(refinement, surface.control_mesh.vertices, level, RunContext());
  for (const auto& p : limit.positions.colwise()) {
    surface.colors.push_back(ColorAt(p, paint, size));
  }
  return surface;
}

double Rms(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  double sum = 0;
  for (size_t v = 0; v < a.size(); ++v) {
    for (size_t k = 0; k < 3; ++k) sum += std::pow((a[v][k] - b[v][k]) / 255.0, 2);
  }
  return std::sqrt(sum / (3 * static_cast<double>(a.size())));
}

EncodedSurface Coded(const DisplacedSurface& surface, int threads = 1) {
  RunContext context;
  context.threads = threads;
  EncodedSurface encoded = *EncodeDss(surface, {}, {}, context);
  EXPECT_TRUE(AddColors(surface, std::nullopt, context, &encoded).ok());
  return encoded;
}

TEST(ColorsTest, DecodedWithinTheErrorAndForHalfAByteAVertex) {
  for (const Paint paint : {Paint::kSmooth, Paint::kChecker}) {
    const DisplacedSurface surface = Painted(Torus(12, 20), 4, paint);
    EncodedSurface encoded = *EncodeDss(surface, {}, {}, RunContext());
    const auto colors = AddColors(surface, std::nullopt, RunContext(), &encoded);
    ASSERT_TRUE(colors.ok()) << colors.status();
    const DecodedSurface decoded = *DecodeDss(encoded.Concatenate(), RunContext());
    ASSERT_EQ(decoded.surface.colors.size(), surface.colors.size());
    const double rms = Rms(decoded.surface.colors, surface.colors);
    const double bytes =
        static_cast<double>(colors->bytes) / static_cast<double>(surface.colors.size());
    RecordProperty("rms", std::to_string(rms));
    RecordProperty("bytes_per_vertex", std::to_string(bytes));
    EXPECT_LT(rms, 1.05 * kColorError);
    EXPECT_NEAR(rms, colors->rms, 0.2 * rms);
    EXPECT_LT(bytes, 0.5);
    EXPECT_EQ(decoded.surface.heights,
              DecodeDss(EncodeDss(surface, {}, {}, RunContext())->Concatenate(), RunContext())
                  ->surface.heights);
  }
}

TEST(ColorsTest, EveryPrefixOfWholeChunksHasColours) {
  const DisplacedSurface surface = Painted(Torus(8, 10), 4, Paint::kSmooth);
  const std::vector<uint8_t> bytes = Coded(surface).Concatenate();
  const ChunkList list = *ListChunks(bytes);
  size_t size = 0;
  double last = 1;
  bool any = false;
  for (const Chunk& chunk : list.chunks) {
    size += static_cast<size_t>(chunk.bytes);
    const auto decoded = DecodeDss(std::span(bytes).first(size), RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    any |= chunk.tag == kColorsTag;
    ASSERT_EQ(decoded->surface.colors.size(), any ? decoded->surface.heights.size() : 0);
    if (chunk.tag != kColorsTag) continue;
    const std::vector<Rgb> true_colors(
        surface.colors.begin(),
        surface.colors.begin() + static_cast<std::ptrdiff_t>(decoded->surface.colors.size()));
    const double rms = Rms(decoded->surface.colors, true_colors);
    EXPECT_LT(rms, std::max(0.02, 1.1 * last)) << "after " << size << " bytes";
    last = rms;
  }
  EXPECT_LT(last, 1.05 * kColorError);
}

TEST(ColorsTest, SurfacesWithoutThemKeepTheirBytesAndChunksAreAddedAlone) {
  DisplacedSurface surface = Painted(Torus(6, 8), 3, Paint::kChecker);
  const EncodedSurface plain = *EncodeDss(surface, {}, {}, RunContext());
  const EncodedSurface colored = Coded(surface);
  ASSERT_EQ(plain.chunks.size(), colored.chunks.size());
  for (size_t i = 1; i < plain.chunks.size(); ++i) {
    ASSERT_GE(colored.chunks[i].size(), plain.chunks[i].size());
    EXPECT_TRUE(
        std::equal(plain.chunks[i].begin(), plain.chunks[i].end(), colored.chunks[i].begin()));
  }
  surface.colors.clear();
  EXPECT_EQ(EncodeDss(surface, {}, {}, RunContext())->Concatenate(), plain.Concatenate());
}

TEST(ColorsTest, GroupsRegionsAndThreadsGiveTheSame) {
  const DisplacedSurface surface = Painted(Torus(48, 48), 2, Paint::kSmooth);
  const std::vector<uint8_t> bytes = Coded(surface).Concatenate();
  EXPECT_EQ(Coded(surface, 3).Concatenate(), bytes);
  const DecodedSurface whole = *DecodeDss(bytes, RunContext());
  EXPECT_LT(Rms(whole.surface.colors, surface.colors), 1.05 * kColorError);
  std::vector<int> faces(60);
  std::iota(faces.begin(), faces.end(), 700);
  for (const int level : {0, 1, 2}) {
    const auto part = DecodeRegion(bytes, faces, level, RunContext());
    ASSERT_TRUE(part.ok()) << part.status();
    EXPECT_GT(part->groups, 1);
    ASSERT_EQ(part->colors.size(), part->region.vertices.size());
    for (size_t i = 0; i < part->colors.size(); ++i) {
      EXPECT_EQ(part->colors[i], whole.surface.colors[part->region.vertices[i]]);
    }
  }
}

TEST(ColorsTest, KeepTheBytesAskedForOrAreLeftOut) {
  const DisplacedSurface surface = Painted(Torus(12, 20), 4, Paint::kChecker);
  const EncodedSurface plain = *EncodeDss(surface, {}, {}, RunContext());
  const auto size = static_cast<int64_t>(plain.Concatenate().size());
  EncodedSurface room = plain, none = plain;
  ASSERT_GT(AddColors(surface, size + 3000, RunContext(), &room)->bytes, 0);
  EXPECT_LE(room.Concatenate().size(), static_cast<size_t>(size + 3000));
  EXPECT_EQ(AddColors(surface, size + 10, RunContext(), &none)->bytes, 0);
  EXPECT_EQ(none.Concatenate(), plain.Concatenate());
}

// RMS of the colours about their mean.
double Spread(const std::vector<Rgb>& colors) {
  std::array<double, 3> sum{}, squares{};
  for (const Rgb& color : colors) {
    for (size_t k = 0; k < 3; ++k) {
      sum[k] += color[k] / 255.0;
      squares[k] += std::pow(color[k] / 255.0, 2);
    }
  }
  const auto count = static_cast<double>(colors.size());
  double spread = 0;
  for (size_t k = 0; k < 3; ++k) spread += squares[k] / count - std::pow(sum[k] / count, 2);
  return std::sqrt(spread / 3);
}

TEST(ColorsTest, RoomIsUsedOrLeftAndWhatIsThereDecodes) {
  for (const double size : {0.03, 0.3}) {
    const DisplacedSurface surface = Painted(Torus(12, 20), 3, Paint::kChecker, size);
    const EncodedSurface plain = *EncodeDss(surface, {}, {}, RunContext());
    const auto bare = static_cast<int64_t>(plain.Concatenate().size());
    double last = Spread(surface.colors);
    for (const int64_t room : {30, 200, 800, 1500, 3000}) {
      EncodedSurface coded = plain;
      const auto colors = AddColors(surface, bare + room, RunContext(), &coded);
      ASSERT_TRUE(colors.ok()) << colors.status();
      EXPECT_LE(colors->bytes, room);
      if (room >= 800) {
        EXPECT_GT(colors->bytes, room / 2) << size;
      }
      const auto decoded = DecodeDss(coded.Concatenate(), RunContext());
      ASSERT_TRUE(decoded.ok()) << room << ": " << decoded.status();
      EXPECT_EQ(decoded->surface.colors.empty(), colors->bytes == 0);
      if (colors->bytes == 0) continue;
      EXPECT_LT(colors->rms, last) << size << " in " << room;
      last = colors->rms;
      EXPECT_NEAR(Rms(decoded->surface.colors, surface.colors), colors->rms, 0.2 * colors->rms);
    }
  }
}

// Many colours and next to no room: the decoder knows no units above 1.
TEST(ColorsTest, TooManyColoursForTheRoomAreLeftOut) {
  DisplacedSurface surface = Painted(Torus(24, 24), 3, Paint::kSmooth);
  uint32_t state = 1;
  for (Rgb& color : surface.colors) {
    for (uint8_t& channel : color)
      channel = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  }
  const EncodedSurface plain = *EncodeDss(surface, {}, {}, RunContext());
  EncodedSurface coded = plain;
  const auto size = static_cast<int64_t>(plain.Concatenate().size());
  const auto colors = AddColors(surface, size + 200, RunContext(), &coded);
  ASSERT_TRUE(colors.ok()) << colors.status();
  EXPECT_EQ(colors->bytes, 0);
  const auto decoded = DecodeDss(coded.Concatenate(), RunContext());
  EXPECT_TRUE(decoded.ok()) << decoded.status();
}

TEST(ColorsTest, DamageIsRefused) {
  const DisplacedSurface surface = Painted(Torus(6, 8), 2, Paint::kSmooth);
  const std::vector<uint8_t> bytes = Coded(surface).Concatenate();
  const ChunkList list = *ListChunks(bytes);
  const auto with = [&](auto change) {  // all chunks again, those of colours changed
    std::vector<uint8_t> changed;
    for (size_t i = 0; i < list.chunks.size(); ++i) {
      std::vector<uint8_t> payload(list.chunks[i].payload.begin(), list.chunks[i].payload.end());
      int copies = 1;
      if (list.chunks[i].tag == kColorsTag) copies = change(payload);
      for (; copies > 0; --copies) {
        const auto chunk = WrapChunk(list.chunks[i].tag, payload, i == 0);
        changed.insert(changed.end(), chunk.begin(), chunk.end());
      }
    }
    return DecodeDss(changed, RunContext()).status();
  };
  EXPECT_TRUE(with([](auto&) { return 1; }).ok());
  EXPECT_TRUE(with([](auto&) { return 0; }).ok());
  EXPECT_TRUE(absl::IsDataLoss(with([](auto&) { return 2; })));
  EXPECT_TRUE(absl::IsDataLoss(with([](auto& payload) {
    payload.resize(payload.size() / 2);
    return 1;
  })));
  EXPECT_TRUE(absl::IsDataLoss(with([](auto& payload) {
    payload.clear();
    return 1;
  })));
}

}  // namespace
}  // namespace rilievo
