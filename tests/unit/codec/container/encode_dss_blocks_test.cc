// Files made of some groups at a time.
#include "core/codec/container/encode_dss_blocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/codec/container/dss.h"
#include "core/codec/mesh/face_groups.h"
#include "core/surface/heights_in_memory.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

EncodeOptions Options() {
  EncodeOptions options;
  options.group_faces = kLeastGroupLimit;
  options.position_step = 4e-4;
  options.max_error = 5e-5;
  return options;
}

constexpr int64_t kBlockVertices = 3000;  // in the surfaces here: one group or two

absl::StatusOr<EncodedSurface> InBlocks(const DisplacedSurface& surface,
                                        const EncodeOptions& options, int threads = 0,
                                        int64_t block_vertices = kBlockVertices) {
  const PartCutter cutter = PartCutter::Make(surface.control_mesh).value();
  const HeightsInMemory heights(surface, cutter.topology());
  RunContext context;
  context.threads = threads;
  return EncodeDssBlocks(Stored(surface, heights), cutter, {}, options, block_vertices, context);
}

int64_t Bytes(const EncodedSurface& encoded) {
  return static_cast<int64_t>(encoded.Concatenate().size());
}

double HeightRms(const DisplacedSurface& a, const DisplacedSurface& b) {
  double sum = 0, count = 0;
  for (size_t v = 0; v < a.heights.size(); ++v) {
    if (a.sources[v] == HeightSource::kFilled) continue;
    sum += std::pow(double{a.heights[v]} - b.heights[v], 2);
    count += 1;
  }
  return std::sqrt(sum / count);
}

// A torus beside a sheet with a hole, with filled, smoothed and measured heights.
const DisplacedSurface& Mixed() {
  static const DisplacedSurface surface =
      SurfaceOver(Together(Torus(36, 24), Sheet(20, 20, true), Eigen::Vector3d(0.02, 0.05, 0.01)),
                  3, 4e-4, 2e-4);
  return surface;
}

void ExpectAsSmallAndAsExactAsTheWhole(const DisplacedSurface& surface) {
  const EncodedSurface whole = EncodeDss(surface, {}, Options(), RunContext()).value();
  const EncodedSurface blocks = InBlocks(surface, Options()).value();
  const DisplacedSurface of_whole = DecodeDss(whole.Concatenate(), RunContext())->surface;
  const DisplacedSurface of_blocks = DecodeDss(blocks.Concatenate(), RunContext())->surface;
  EXPECT_LT(static_cast<double>(Bytes(blocks)), 1.02 * static_cast<double>(Bytes(whole)));
  EXPECT_LE(blocks.height_rms, *Options().max_error);
  EXPECT_LT(HeightRms(surface, of_blocks), 1.02 * HeightRms(surface, of_whole));
  EXPECT_LT(blocks.height_max, 1.5 * whole.height_max);
  EXPECT_EQ(of_blocks.sources, of_whole.sources);
  EXPECT_EQ(of_blocks.control_mesh.faces, of_whole.control_mesh.faces);
  EXPECT_EQ(of_blocks.control_mesh.diagonals, of_whole.control_mesh.diagonals);
  EXPECT_EQ(of_blocks.control_mesh.creases, of_whole.control_mesh.creases);
}

TEST(EncodeDssBlocksTest, BlocksAreAsSmallAndAsExactAsTheWhole) {
  ExpectAsSmallAndAsExactAsTheWhole(Mixed());
}

// Where corrections of the heights would grow from round to round if nothing held them back.
TEST(EncodeDssBlocksTest, BlocksOfUnevenFacesAreAsGoodAsTheWhole) {
  ExpectAsSmallAndAsExactAsTheWhole(SurfaceOver(Uneven(Torus(36, 24), 8), 4, 4e-4, 1e-4));
}

TEST(EncodeDssBlocksTest, BlocksOfCreasedQuadsAreAsGoodAsTheWhole) {
  const DisplacedSurface surface = SurfaceOver(InQuadsOf(Torus(36, 24), true), 3, 4e-4, 2e-4);
  ASSERT_TRUE(surface.control_mesh.quads());
  ASSERT_FALSE(surface.control_mesh.creases.empty());
  ExpectAsSmallAndAsExactAsTheWhole(surface);
}

TEST(EncodeDssBlocksTest, TheErrorStatedIsThatOfTheDecodedHeights) {
  const DisplacedSurface surface = SurfaceOver(Torus(30, 20), 4, 4e-4, 1e-4);
  const EncodedSurface encoded = InBlocks(surface, Options()).value();
  const DisplacedSurface decoded = DecodeDss(encoded.Concatenate(), RunContext())->surface;
  double largest = 0;
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    if (surface.sources[v] == HeightSource::kFilled) continue;
    largest = std::max(largest, std::abs(double{surface.heights[v]} - decoded.heights[v]));
  }
  EXPECT_NEAR(encoded.height_rms, HeightRms(surface, decoded), 0.05 * encoded.height_rms);
  EXPECT_NEAR(encoded.height_max, largest, 0.02 * largest);
}

// Errors beside the border of a block are like those inside.
TEST(EncodeDssBlocksTest, BlocksLeaveNoTrace) {
  const DisplacedSurface surface = SurfaceOver(Torus(36, 24), 4, 4e-4, 1e-4);
  const EncodedSurface encoded = InBlocks(surface, Options(), 0, 1).value();
  const DisplacedSurface decoded = DecodeDss(encoded.Concatenate(), RunContext())->surface;
  const PartCutter cutter = PartCutter::Make(surface.control_mesh).value();
  std::vector<GridPoint> points(surface.control_mesh.vertices.cols());
  for (Eigen::Index v = 0; v < surface.control_mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      points[v][axis] =
          static_cast<int32_t>(std::lround(surface.control_mesh.vertices(axis, v) / 4e-4));
    }
  }
  const FaceGroups groups = GroupFaces(cutter.topology(), points, kLeastGroupLimit);
  const FaceVertices vertices(cutter.topology(), surface.max_level);
  std::vector<int> of_face;
  double inside = 0, border = 0, insides = 0, borders = 0;
  for (int f = 0; f < cutter.topology().face_count(); ++f) {
    bool at_border = false;
    for (const int neighbor : cutter.topology().face_neighbors.col(f)) {
      at_border = at_border || groups.group_of[neighbor] != groups.group_of[f];
    }
    vertices.Of(f, of_face);
    for (const int v : of_face) {
      if (surface.sources[v] == HeightSource::kFilled) continue;
      const double squared = std::pow(double{surface.heights[v]} - decoded.heights[v], 2);
      (at_border ? border : inside) += squared;
      (at_border ? borders : insides) += 1;
    }
  }
  ASSERT_GT(borders, 1000);
  EXPECT_LT(std::sqrt(border / borders), 1.05 * std::sqrt(inside / insides));
}

TEST(EncodeDssBlocksTest, TheNumberOfThreadsDoesNotChangeAByte) {
  EXPECT_EQ(InBlocks(Mixed(), Options(), 1)->Concatenate(),
            InBlocks(Mixed(), Options(), 3)->Concatenate());
}

TEST(EncodeDssBlocksTest, TakesAStepOrASize) {
  EncodeOptions options = Options();
  options.max_error.reset();
  options.height_step = 2e-4;
  EXPECT_EQ(InBlocks(Mixed(), options)->height_step, 2e-4);
  options.height_step = 0;
  options.max_bytes = 9000;
  const EncodedSurface sized = InBlocks(Mixed(), options).value();
  EXPECT_LE(Bytes(sized), 9000);
  EXPECT_GT(Bytes(sized), 7000);
}

TEST(EncodeDssBlocksTest, RefusesWhatHasNoGroups) {
  EncodeOptions options = Options();
  options.group_faces = 0;
  EXPECT_THAT(InBlocks(Mixed(), options).status().message(), HasSubstr("encode.group_faces is 0"));
  const DisplacedSurface coarse = SurfaceOver(Torus(12, 12), 1, 4e-4, 1e-4);
  EXPECT_THAT(InBlocks(coarse, Options()).status().message(),
              HasSubstr("max_level is 1, must be 2 to 8"));
}

}  // namespace
}  // namespace rilievo
