#include "core/codec/container/open_dss.h"

#include <gtest/gtest.h>

#include "core/codec/container/dss.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

EncodedSurface Encoded() {
  EncodeOptions options;
  options.position_step = 4e-4;
  options.group_faces = kLeastGroupLimit;
  return *EncodeDss(SurfaceOver(Torus(16, 9), 3, 4e-4, 1e-4), {}, options, RunContext());
}

TEST(OpenDssTest, FindsTheLayersAndTheGroups) {
  const EncodedSurface encoded = Encoded();
  const std::vector<uint8_t> bytes = encoded.Concatenate();
  const auto file = OpenDss(bytes, true);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->version, kDssVersion);
  EXPECT_EQ(file->layers.size(), 4u);
  EXPECT_EQ(file->mesh.faces.cols(), 288);
  EXPECT_EQ(file->header.group_limit, kLeastGroupLimit);
  EXPECT_EQ(file->groups.count(), 4);
  EXPECT_EQ(file->Payloads()[2].data(), file->layers[2].payload.data());
  EXPECT_TRUE(CheckHeightLaw(*file).ok());
  ASSERT_TRUE(file->SmoothedPayload().has_value());
  EXPECT_EQ(file->SmoothedPayload()->size(), encoded.chunks.back().size() - 6);
  // It is about the finest level: of no use without that, or before it.
  EncodedSurface other = encoded;
  other.chunks.erase(other.chunks.end() - 2);
  EXPECT_FALSE(OpenDss(other.Concatenate(), true)->smoothed.has_value());
  other = encoded;
  std::swap(other.chunks[5], other.chunks[4]);
  EXPECT_FALSE(OpenDss(other.Concatenate(), true)->smoothed.has_value());
}

// With groups, only the chunks that stand for all faces are held to their checksums.
TEST(OpenDssTest, ChecksumsOfGroupsAreLookedAtOnDemand) {
  const EncodedSurface encoded = Encoded();
  size_t end = 0;
  for (size_t chunk = 0; chunk < encoded.chunks.size(); ++chunk) {
    end += encoded.chunks[chunk].size();
    std::vector<uint8_t> spoiled = encoded.Concatenate();
    spoiled[end - 1] ^= 1;
    EXPECT_EQ(OpenDss(spoiled, true).status().code(), absl::StatusCode::kDataLoss);
    EXPECT_EQ(OpenDss(spoiled, false).ok(), chunk > kFirstGroupedLevel) << "chunk " << chunk;
  }
}

}  // namespace
}  // namespace rilievo
