// Round trips: everything that goes into a .dss comes out, over every kind of control mesh.
#include <limits>

#include "core/codec/dss.h"
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

TEST(EncodeDssTest, RoundTripsEveryTopology) {
  const EncodeOptions options;
  for (const Case& c : Cases()) {
    SCOPED_TRACE(c.name);
    const DisplacedSurface surface =
        SurfaceOver(Shuffled(c.mesh, 5), c.max_level, options.position_step, 1e-4);
    DssMetadata metadata;
    metadata.generator = "codec test";
    metadata.error_rms = 1.25e-4;
    metadata.scan_points = 123456789;
    metadata.road = "spherical";
    const auto encoded = EncodeDss(surface, metadata, options, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    ASSERT_EQ(encoded->chunks.size(), static_cast<size_t>(c.max_level) + 2);
    const std::vector<uint8_t> bytes = encoded->Concatenate();
    const auto decoded = DecodeDss(bytes, RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();

    EXPECT_EQ(decoded->surface.control_mesh.vertices, surface.control_mesh.vertices);
    EXPECT_EQ(decoded->surface.control_mesh.faces, surface.control_mesh.faces);
    EXPECT_EQ(decoded->surface.frame.center, surface.frame.center);
    EXPECT_EQ(decoded->surface.frame.diagonal, surface.frame.diagonal);
    EXPECT_EQ(decoded->surface.max_level, c.max_level);
    EXPECT_EQ(decoded->declared_max_level, c.max_level);
    EXPECT_EQ(decoded->surface.sources, surface.sources);
    ASSERT_EQ(decoded->surface.heights.size(), surface.heights.size());
    for (size_t v = 0; v < surface.heights.size(); ++v) {
      // Half a step, and the rounding of the height to float.
      ASSERT_NEAR(decoded->surface.heights[v], surface.heights[v],
                  options.height_step / 2 + 1e-7 * std::abs(surface.heights[v]))
          << v;
    }
    EXPECT_EQ(decoded->format_version, 1);
    EXPECT_EQ(decoded->metadata.generator, metadata.generator);
    EXPECT_EQ(decoded->metadata.error_rms, metadata.error_rms);
    EXPECT_EQ(decoded->metadata.error_max, -1);
    EXPECT_EQ(decoded->metadata.scan_points, metadata.scan_points);
    EXPECT_EQ(decoded->metadata.road, metadata.road);
    ASSERT_EQ(decoded->chunk_bytes.size(), encoded->chunks.size());
    for (size_t i = 0; i < encoded->chunks.size(); ++i) {
      EXPECT_EQ(decoded->chunk_bytes[i], static_cast<int64_t>(encoded->chunks[i].size()));
    }
  }
}

TEST(EncodeDssTest, WhatWasDecodedEncodesToTheSameBytes) {
  const EncodeOptions options;
  for (const Case& c : Cases()) {
    SCOPED_TRACE(c.name);
    const DisplacedSurface surface = SurfaceOver(c.mesh, c.max_level, options.position_step, 1e-4);
    const auto bytes = EncodeDss(surface, {}, options, RunContext())->Concatenate();
    const auto decoded = DecodeDss(bytes, RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(EncodeDss(decoded->surface, {}, options, RunContext())->Concatenate(), bytes);
  }
}

TEST(EncodeDssTest, ThreadsDoNotChangeTheBytes) {
  const EncodeOptions options;
  const DisplacedSurface surface = SurfaceOver(Torus(20, 12), 4, options.position_step, 1e-4);
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_EQ(EncodeDss(surface, {}, options, one)->Concatenate(),
            EncodeDss(surface, {}, options, two)->Concatenate());
}

// A flat surface would code into almost nothing; the decoder's law must hold all the same.
TEST(EncodeDssTest, PadsWhatIsTooSmallForTheLaw) {
  const EncodeOptions options;
  DisplacedSurface surface = SurfaceOver(Torus(40, 24), 4, options.position_step, 0);
  std::fill(surface.heights.begin(), surface.heights.end(), 0.0f);
  std::fill(surface.sources.begin(), surface.sources.end(), HeightSource::kMeasured);
  const auto encoded = EncodeDss(surface, {}, options, RunContext());
  ASSERT_TRUE(encoded.ok());
  const int64_t new_heights = 3 * 960 * 64;  // a torus has three edges a vertex, at level 3
  EXPECT_GE(static_cast<int64_t>(encoded->chunks.back().size()), new_heights / 256);
  EXPECT_LE(static_cast<int64_t>(encoded->chunks.back().size()), new_heights / 256 + 100);
  const auto decoded = DecodeDss(encoded->Concatenate(), RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->surface.heights, surface.heights);
}

TEST(EncodeDssTest, NamesWhatIsWrong) {
  const EncodeOptions options;
  const DisplacedSurface good = SurfaceOver(Torus(8, 6), 2, options.position_step, 1e-4);
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
  steps.height_step = 0;
  EXPECT_THAT(message(good, steps), HasSubstr("encode.height_step is 0"));
  steps = EncodeOptions();
  steps.position_step = 0.02;
  EXPECT_THAT(message(good, steps), HasSubstr("encode.position_step is 0.02"));
}

TEST(EncodeDssTest, StopsWhenAsked) {
  const DisplacedSurface surface = SurfaceOver(Torus(8, 6), 2, EncodeOptions().position_step, 1e-4);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(EncodeDss(surface, {}, {}, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
