// Round trips: everything that goes into a .dss comes out, over every kind of control mesh.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/codec/container/dss.h"
#include "core/codec/heights/edge_rules.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

struct Case {
  const char* name;
  ControlMesh mesh;
  int max_level;
};

std::vector<Case> Cases() {
  ControlMesh triangle;
  triangle.vertices = Eigen::Matrix3Xd::Identity(3, 3) * 0.3;
  triangle.faces = Eigen::Vector3i(0, 1, 2);
  return {
      {"triangle", triangle, 3},
      {"octahedron", Octahedron(), 3},
      {"torus", Torus(8, 6), 3},
      {"long torus", Torus(40, 3), 2},
      {"sheet", Sheet(7, 9, false), 3},
      {"sheet with hole", Sheet(7, 9, true), 3},
      {"two closed", Together(Torus(7, 5), Octahedron(), {0.1, 0.2, 0.3}), 2},
      {"open and closed", Together(Sheet(5, 5, true), Octahedron(), {0, 0, 0.2}), 2},
      {"control points only", Torus(8, 6), 0},
  };
}

// Small holes are kept, patches of smoothed and measured heights as far as they pay.
void ExpectSources(const std::vector<HeightSource>& decoded,
                   const std::vector<HeightSource>& given) {
  ASSERT_EQ(decoded.size(), given.size());
  size_t same = 0;
  for (size_t v = 0; v < given.size(); ++v) {
    EXPECT_EQ(decoded[v] == HeightSource::kFilled, given[v] == HeightSource::kFilled);
    same += decoded[v] == given[v];
  }
  EXPECT_GE(same * 2, given.size());
}

// Root mean square and largest error of the heights that are not filled in.
std::pair<double, double> HeightErrors(const DisplacedSurface& decoded,
                                       const DisplacedSurface& given) {
  double sum = 0, largest = 0;
  int count = 0;
  for (size_t v = 0; v < given.heights.size(); ++v) {
    if (given.sources[v] == HeightSource::kFilled) continue;
    const double error = std::abs(decoded.heights[v] - given.heights[v]);
    sum += error * error;
    largest = std::max(largest, error);
    ++count;
  }
  return {count > 0 ? std::sqrt(sum / count) : 0, largest};
}

TEST(EncodeDssTest, RoundTripsEveryTopology) {
  EncodeOptions options;
  options.height_step = 2e-5;
  options.smallest_hole = 1;
  for (const Case& c : Cases()) {
    SCOPED_TRACE(c.name);
    const DisplacedSurface surface =
        SurfaceOver(Shuffled(c.mesh, 5), c.max_level, kPositionStep, 1e-4);
    DssMetadata metadata;
    metadata.generator = "codec test";
    metadata.topology = "spherical";
    const auto encoded = EncodeDss(surface, metadata, options, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    const size_t layers = static_cast<size_t>(c.max_level) + 2;
    ASSERT_GE(encoded->chunks.size(), layers);
    ASSERT_LE(encoded->chunks.size(), layers + 1);
    const std::vector<uint8_t> bytes = encoded->Concatenate();
    const auto decoded = DecodeDss(bytes, RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();

    EXPECT_EQ(decoded->surface.control_mesh.vertices, surface.control_mesh.vertices);
    EXPECT_EQ(decoded->surface.control_mesh.faces, surface.control_mesh.faces);
    EXPECT_EQ(decoded->surface.frame.center, surface.frame.center);
    EXPECT_EQ(decoded->surface.frame.diagonal, surface.frame.diagonal);
    EXPECT_EQ(decoded->surface.max_level, c.max_level);
    EXPECT_EQ(decoded->declared_max_level, c.max_level);
    ExpectSources(decoded->surface.sources, surface.sources);
    ASSERT_EQ(decoded->surface.heights.size(), surface.heights.size());
    const auto [rms, largest] = HeightErrors(decoded->surface, surface);
    EXPECT_LT(rms, 0.5 * options.height_step);
    EXPECT_LT(largest, 6 * options.height_step);
    EXPECT_EQ(decoded->format_version, 3);
    EXPECT_EQ(decoded->metadata.generator, metadata.generator);
    EXPECT_EQ(decoded->metadata.topology, metadata.topology);
    ASSERT_EQ(decoded->chunk_bytes.size(), encoded->chunks.size());
    for (size_t i = 0; i < encoded->chunks.size(); ++i) {
      EXPECT_EQ(decoded->chunk_bytes[i], static_cast<int64_t>(encoded->chunks[i].size()));
    }
  }
}

TEST(EncodeDssTest, SaysTheErrorThatADecoderFinds) {
  const DisplacedSurface surface = SurfaceOver(Torus(12, 8), 4, kPositionStep, 1e-4);
  for (double step : {1e-5, 1e-4, 1e-3}) {
    EncodeOptions options;
    options.height_step = step;
    const auto encoded = EncodeDss(surface, {}, options, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    const auto decoded = DecodeDss(encoded->Concatenate(), RunContext());
    const auto [rms, largest] = HeightErrors(decoded->surface, surface);
    // By area there, by vertex here: the torus' faces are up to twice as large outside as inside.
    EXPECT_NEAR(encoded->height_rms / rms, 1, 0.2);
    EXPECT_NEAR(encoded->height_max, largest, 1e-6);
    EXPECT_EQ(encoded->height_step, step);
  }
}

TEST(EncodeDssTest, KeepsTheErrorOrTheBytesAskedFor) {
  const DisplacedSurface surface = SurfaceOver(Torus(12, 8), 4, 1e-3, 2e-4);
  EncodeOptions options;
  options.position_step = 1e-3;
  int64_t last = 0;
  for (double error : {1e-3, 3e-4, 1e-4, 3e-5, 1e-5}) {
    options.max_error = error;
    const auto encoded = EncodeDss(surface, {}, options, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    EXPECT_LE(encoded->height_rms, error);
    EXPECT_GE(encoded->height_rms, 0.9 * error);
    const int64_t bytes = static_cast<int64_t>(encoded->Concatenate().size());
    EXPECT_GT(bytes, last);
    last = bytes;
  }
  options.max_error.reset();
  double last_error = 1;
  for (int64_t bytes : {1000, 2000, 5000, 10000}) {
    options.max_bytes = bytes;
    const auto encoded = EncodeDss(surface, {}, options, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    const int64_t size = static_cast<int64_t>(encoded->Concatenate().size());
    EXPECT_LE(size, bytes);
    EXPECT_GE(size, 0.9 * bytes);
    EXPECT_LT(encoded->height_rms, last_error);
    last_error = encoded->height_rms;
  }
  options.max_bytes = 100;
  EXPECT_EQ(EncodeDss(surface, {}, options, RunContext()).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST(EncodeDssTest, SpendsNothingBelowTheNoise) {
  const DisplacedSurface surface = SurfaceOver(Torus(12, 8), 4, kPositionStep, 2e-4);
  EncodeOptions options;
  const int64_t plain = EncodeDss(surface, {}, options, RunContext())->Concatenate().size();
  options.noise_floor = 1e-4;
  const auto floored = EncodeDss(surface, {}, options, RunContext());
  EXPECT_LE(floored->height_rms, 5e-5);
  EXPECT_GE(floored->height_rms, 4.5e-5);
  EXPECT_LT(static_cast<int64_t>(floored->Concatenate().size()), plain / 2);
  // A coarser step asked for stays, and so does a tight limit of bytes.
  options.height_step = 1e-3;
  EXPECT_EQ(EncodeDss(surface, {}, options, RunContext())->height_step, 1e-3);
  options.max_bytes = 1000000;
  EXPECT_GE(EncodeDss(surface, {}, options, RunContext())->height_rms, 4.5e-5);
  options.max_bytes.reset();
  options.max_error = 1e-6;
  EXPECT_GE(EncodeDss(surface, {}, options, RunContext())->height_rms, 4.5e-5);
}

int64_t CountOf(HeightSource source, const DisplacedSurface& surface) {
  return std::count(surface.sources.begin(), surface.sources.end(), source);
}

// Sides of a plane: the border alone takes bits.
TEST(EncodeDssTest, SmoothedHeightsComeBackAsSuch) {
  for (const int group_faces : {0, 128}) {
    SCOPED_TRACE(group_faces);
    DisplacedSurface surface = SurfaceOver(Torus(20, 12), 4, kPositionStep, 1e-4);
    const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 4, RunContext());
    const LimitSurface limit =
        *EvaluateLimit(refinement, surface.control_mesh.vertices, 4, RunContext());
    for (size_t v = 0; v < surface.sources.size(); ++v) {
      if (surface.sources[v] == HeightSource::kFilled) continue;
      const bool smoothed = limit.positions(1, static_cast<Eigen::Index>(v)) < 0.05;
      surface.sources[v] = smoothed ? HeightSource::kSmoothed : HeightSource::kMeasured;
    }
    EncodeOptions options;
    options.group_faces = group_faces;
    const EncodedSurface encoded = *EncodeDss(surface, {}, options, RunContext());
    ASSERT_EQ(encoded.chunks.size(), 7u);
    EXPECT_EQ(encoded.chunks[6][0], 's');
    const std::vector<uint8_t> bytes = encoded.Concatenate();
    EXPECT_LE(encoded.chunks[6].size() * 32, bytes.size());
    EXPECT_EQ(DecodeDss(bytes, RunContext())->surface.sources, surface.sources);
    // Without the last chunk, smoothed heights are not told from measured ones.
    const auto before =
        DecodeDss(std::span(bytes).first(bytes.size() - encoded.chunks[6].size()), RunContext());
    EXPECT_EQ(CountOf(HeightSource::kFilled, before->surface),
              CountOf(HeightSource::kFilled, surface));
    EXPECT_EQ(CountOf(HeightSource::kSmoothed, before->surface), 0);

    // A few bytes are kept to, whatever becomes of the flags.
    options.max_bytes = 1500;
    const EncodedSurface small = *EncodeDss(surface, {}, options, RunContext());
    EXPECT_LE(small.Concatenate().size(), 1500u);

    // All of them, or none: two bytes, or nothing.
    options.max_bytes.reset();
    for (const HeightSource all : {HeightSource::kMeasured, HeightSource::kSmoothed}) {
      for (HeightSource& source : surface.sources) {
        if (source != HeightSource::kFilled) source = all;
      }
      const EncodedSurface uniform = *EncodeDss(surface, {}, options, RunContext());
      ASSERT_EQ(uniform.chunks.size(), 6u);
      const size_t less = encoded.chunks[0].size() - uniform.chunks[0].size();
      EXPECT_EQ(less, all == HeightSource::kMeasured ? 0 : static_cast<size_t>(-2));
      const auto decoded = DecodeDss(uniform.Concatenate(), RunContext());
      EXPECT_EQ(decoded->surface.sources, surface.sources);
      EXPECT_EQ(decoded->metadata.all_smoothed, all == HeightSource::kSmoothed);
    }
  }
}

// Finest levels without coefficients take a byte each, and the surface has them all the same.
TEST(EncodeDssTest, PlainLevelsNeedNoChunk) {
  constexpr int kFinest = 5;
  EncodeOptions options;
  options.height_step = 1e-3;
  for (const bool smoothed : {false, true}) {
    SCOPED_TRACE(smoothed);
    DisplacedSurface surface = SurfaceOver(Torus(8, 6), kFinest, kPositionStep, 0);
    for (HeightSource& source : surface.sources) {
      if (!smoothed && source == HeightSource::kSmoothed) source = HeightSource::kMeasured;
    }
    const EncodedSurface encoded = *EncodeDss(surface, {}, options, RunContext());
    const auto tag = [&](size_t chunk) { return static_cast<char>(encoded.chunks[chunk][0]); };
    size_t layers = encoded.chunks.size() - 1;
    if (tag(layers) == 's') --layers;
    ASSERT_LT(layers, kFinest + 1u);
    const auto decoded = DecodeDss(encoded.Concatenate(), RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->declared_max_level, kFinest);
    EXPECT_EQ(decoded->surface.max_level, kFinest);
    EXPECT_EQ(decoded->metadata.plain_levels.size(), kFinest + 1 - layers);
    const auto [rms, largest] = HeightErrors(decoded->surface, surface);
    EXPECT_LT(rms, 0.5 * options.height_step);
    EXPECT_LT(largest, 6 * options.height_step);
    // Levels with a chunk tell what is filled; then a new vertex is where both ends of its edge
    // are.
    const LoopRefinement refinement = *RefineTopology(surface.control_mesh, kFinest, RunContext());
    const std::vector<HeightSource>& sources = decoded->surface.sources;
    const auto is_filled = [&](int v) { return sources[v] == HeightSource::kFilled; };
    for (int v = 0; v < refinement.vertex_count(static_cast<int>(layers) - 1); ++v) {
      EXPECT_EQ(is_filled(v), surface.sources[v] == HeightSource::kFilled);
    }
    for (int level = static_cast<int>(layers); level <= kFinest; ++level) {
      const MeshTopology& topology = refinement.levels[level - 1];
      for (int e = 0; e < topology.edge_count(); ++e) {
        EXPECT_EQ(is_filled(topology.vertex_count + e),
                  is_filled(StencilOfEdge(topology, e).ends[0]) &&
                      is_filled(StencilOfEdge(topology, e).ends[1]));
      }
    }
    EXPECT_NEAR(static_cast<double>(CountOf(HeightSource::kFilled, decoded->surface)),
                static_cast<double>(CountOf(HeightSource::kFilled, surface)),
                0.25 * static_cast<double>(CountOf(HeightSource::kFilled, surface)));
    // A prefix has the levels of its chunks.
    std::vector<uint8_t> part;
    for (size_t chunk = 0; chunk < layers; ++chunk) {
      part.insert(part.end(), encoded.chunks[chunk].begin(), encoded.chunks[chunk].end());
    }
    EXPECT_EQ(DecodeDss(part, RunContext())->surface.max_level,
              std::max(0, static_cast<int>(layers) - 2));
  }
}

TEST(EncodeDssTest, MetadataCanComeLater) {
  DisplacedSurface surface = SurfaceOver(Torus(8, 6), 2, kPositionStep, 1e-4);
  std::fill(surface.sources.begin(), surface.sources.end(), HeightSource::kSmoothed);
  EncodedSurface encoded = *EncodeDss(surface, {}, {}, RunContext());
  const auto before = *DecodeDss(encoded.Concatenate(), RunContext());
  EXPECT_EQ(before.metadata.error_rms, -1);
  DssMetadata metadata;
  metadata.error_rms = 1.25e-4;
  metadata.input_hash = std::string(32, '\x80');
  ASSERT_TRUE(ReplaceMetadata(metadata, encoded).ok());
  const auto after = *DecodeDss(encoded.Concatenate(), RunContext());
  EXPECT_EQ(after.metadata.error_rms, metadata.error_rms);
  EXPECT_EQ(after.metadata.input_hash, metadata.input_hash);
  EXPECT_EQ(after.surface.heights, before.surface.heights);
  EXPECT_EQ(after.surface.sources, surface.sources);
  EXPECT_EQ(after.surface.control_mesh.vertices, before.surface.control_mesh.vertices);
  EncodedSurface none;
  EXPECT_EQ(ReplaceMetadata(metadata, none).code(), absl::StatusCode::kInvalidArgument);
}

TEST(EncodeDssTest, ThreadsDoNotChangeTheBytes) {
  EncodeOptions options;
  const DisplacedSurface surface = SurfaceOver(Torus(20, 12), 4, kPositionStep, 1e-4);
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  for (const int group_faces : {0, 128}) {
    options.group_faces = group_faces;
    const std::vector<uint8_t> bytes = EncodeDss(surface, {}, options, one)->Concatenate();
    EXPECT_EQ(EncodeDss(surface, {}, options, two)->Concatenate(), bytes);
    EXPECT_EQ(DecodeDss(bytes, one)->surface.heights, DecodeDss(bytes, two)->surface.heights);
  }
}

// A flat surface codes into almost nothing; beyond the free heights the law must hold all the same.
TEST(EncodeDssTest, PadsWhatIsTooSmallForTheLaw) {
  const EncodeOptions options;
  for (int level : {4, 5}) {
    DisplacedSurface surface = SurfaceOver(Torus(40, 24), level, kPositionStep, 0);
    std::fill(surface.heights.begin(), surface.heights.end(), 0.0f);
    std::fill(surface.sources.begin(), surface.sources.end(), HeightSource::kMeasured);
    const auto encoded = EncodeDss(surface, {}, options, RunContext());
    ASSERT_TRUE(encoded.ok());
    int64_t bytes = 0;
    for (size_t i = 1; i < encoded->chunks.size(); ++i) bytes += encoded->chunks[i].size();
    const int64_t vertices = 960 << 2 * level;
    const int64_t by_law = std::max<int64_t>(0, vertices - (1 << 18)) / 256;
    EXPECT_GE(bytes, by_law);
    EXPECT_LE(bytes, by_law + 8 * (level + 1));
    const auto decoded = DecodeDss(encoded->Concatenate(), RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->surface.heights, surface.heights);
  }
}

TEST(EncodeDssTest, NamesWhatIsWrong) {
  const EncodeOptions options;
  const DisplacedSurface good = SurfaceOver(Torus(8, 6), 2, kPositionStep, 1e-4);
  const auto message = [&](const DisplacedSurface& surface, const EncodeOptions& with) {
    const absl::Status status = EncodeDss(surface, {}, with, RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    return std::string(status.message());
  };
  DisplacedSurface bad = good;
  bad.control_mesh.vertices(1, 7) += 1e-9;
  EXPECT_THAT(message(bad, options), HasSubstr("coordinate 1 of control point 7"));
  bad = good;
  bad.control_mesh = Shuffled(bad.control_mesh, 3);
  EXPECT_THAT(message(bad, options), HasSubstr("coding order"));
  bad = good;
  bad.heights.pop_back();
  EXPECT_THAT(message(bad, options), HasSubstr("heights"));
  bad = good;
  bad.heights[17] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message(bad, options), HasSubstr("height 17"));
  bad = good;
  bad.sources[11] = static_cast<HeightSource>(3);
  EXPECT_THAT(message(bad, options), HasSubstr("source 11"));
  bad = good;
  bad.max_level = 9;
  EXPECT_THAT(message(bad, options), HasSubstr("max_level is 9"));
  bad = good;
  bad.frame.diagonal = 0;
  EXPECT_EQ(EncodeDss(bad, {}, options, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
  EncodeOptions steps;
  steps.height_step = 0.02;
  EXPECT_THAT(message(good, steps), HasSubstr("encode.height_step is 0.02"));
  steps = EncodeOptions();
  steps.position_step = 0.02;
  EXPECT_THAT(message(good, steps), HasSubstr("encode.position_step is 0.02"));
  EncodeOptions goals;
  goals.max_error = 0.2;
  EXPECT_THAT(message(good, goals), HasSubstr("encode.max_error is 0.2"));
  goals.max_error = 1e-3;
  goals.max_bytes = 1000;
  EXPECT_THAT(message(good, goals), HasSubstr("exclude each other"));
  goals.max_error.reset();
  goals.max_bytes = 0;
  EXPECT_THAT(message(good, goals), HasSubstr("encode.max_bytes is 0"));
  goals = EncodeOptions();
  goals.noise_floor = -1;
  EXPECT_THAT(message(good, goals), HasSubstr("encode.noise_floor is -1"));
  goals = EncodeOptions();
  goals.smallest_hole = 0;
  EXPECT_THAT(message(good, goals), HasSubstr("encode.smallest_hole is 0"));
}

TEST(EncodeDssTest, StopsWhenAsked) {
  const DisplacedSurface surface = SurfaceOver(Torus(8, 6), 2, kPositionStep, 1e-4);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(EncodeDss(surface, {}, {}, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
