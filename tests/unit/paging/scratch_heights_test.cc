// Heights on disk.
#include "core/paging/scratch_heights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <numeric>
#include <vector>

#include "tests/unit/paging/scratch_damage.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

MeshTopology Octahedron() {
  Eigen::Matrix3Xi faces(3, 8);
  faces << 0, 2, 1, 3, 2, 1, 3, 0, 2, 1, 3, 0, 0, 2, 1, 3, 4, 4, 4, 4, 5, 5, 5, 5;
  return BuildMeshTopology(faces, 6).value();
}

// Each face with a height of its own throughout.
ScratchHeights OwnHeights(const MeshTopology& control, int level) {
  ScratchHeights heights = ScratchHeights::Create(::testing::TempDir(), control, level).value();
  const FaceVertices vertices(control, level);
  std::vector<int> of_face;
  for (int f = control.face_count() - 1; f >= 0; --f) {
    vertices.Of(f, of_face);
    const std::vector<float> own(of_face.size(), static_cast<float>(f));
    const HeightSource source = f % 2 == 0 ? HeightSource::kMeasured : HeightSource::kFilled;
    EXPECT_TRUE(heights.Write(f, own, std::vector<HeightSource>(of_face.size(), source)).ok());
  }
  EXPECT_TRUE(heights.Finish().ok());
  return heights;
}

TEST(ScratchHeightsTest, ARecordOfUnknownSourcesIsNotThere) {
  const MeshTopology control = Octahedron();
  ScratchHeights heights = ScratchHeights::Create(::testing::TempDir(), control, 0).value();
  std::vector<HeightSource> sources(3, HeightSource::kMeasured);
  ASSERT_TRUE(heights.Write(2, {0, 0, 0}, sources).ok());
  EXPECT_TRUE(heights.Has(2));
  sources[1] = static_cast<HeightSource>(200);
  ASSERT_TRUE(heights.Write(2, {0, 0, 0}, sources).ok());
  EXPECT_FALSE(heights.Has(2));
}

class ScratchHeightsTest : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Levels, ScratchHeightsTest, ::testing::Values(0, 1, 3));

TEST_P(ScratchHeightsTest, VerticesBetweenFacesHaveTheHeightOfTheFirst) {
  const int level = GetParam();
  const MeshTopology control = Octahedron();
  const ScratchHeights heights = OwnHeights(control, level);
  const FaceVertices vertices(control, level);
  std::vector<int> all(control.face_count()), of_face;
  std::iota(all.begin(), all.end(), 0);
  std::vector<float> read;
  std::vector<HeightSource> sources;
  ASSERT_TRUE(heights.Read(all, vertices, &read, &sources).ok());
  std::vector<float> expected(static_cast<size_t>(vertices.count()));
  for (int f = control.face_count() - 1; f >= 0; --f) {
    vertices.Of(f, of_face);
    for (const int v : of_face) expected[v] = static_cast<float>(f);
  }
  EXPECT_EQ(read, expected);
  std::array<int64_t, 3> counts{};
  for (size_t v = 0; v < read.size(); ++v) {
    EXPECT_EQ(sources[v],
              static_cast<int>(read[v]) % 2 == 0 ? HeightSource::kMeasured : HeightSource::kFilled);
    ++counts[static_cast<size_t>(sources[v])];
  }
  EXPECT_EQ(heights.source_counts(), counts);
}

// A part reads what the whole reads, also where the first face is not in it.
TEST(ScratchHeightsTest, APartReadsTheSame) {
  const MeshTopology control = Octahedron();
  const ScratchHeights heights = OwnHeights(control, 2);
  Eigen::Matrix3Xi faces(3, 2);
  faces << control.faces.col(6), control.faces.col(7);
  const std::array<int, 6> place = {0, 1, -1, 2, -1, 3};
  const MeshTopology part =
      BuildMeshTopology(faces.unaryExpr([&](int v) { return place[v]; }), 4).value();
  const FaceVertices here(part, 2), whole(control, 2);
  std::vector<float> read;
  std::vector<HeightSource> sources;
  ASSERT_TRUE(heights.Read({6, 7}, here, &read, &sources).ok());
  std::vector<int> all(8), from, to;
  std::iota(all.begin(), all.end(), 0);
  std::vector<float> of_whole;
  ASSERT_TRUE(heights.Read(all, whole, &of_whole, &sources).ok());
  for (int f = 0; f < 2; ++f) {
    here.Of(f, to);
    whole.Of(6 + f, from);
    for (size_t p = 0; p < to.size(); ++p) EXPECT_EQ(read[to[p]], of_whole[from[p]]);
  }
}

TEST(ScratchHeightsTest, NamesADamagedRecord) {
  const MeshTopology control = Octahedron();
  const ScratchHeights heights = OwnHeights(control, 2);
  ASSERT_TRUE(DamageScratchFile(3 * (15 * 5 + 4) + 7));
  const FaceVertices vertices(control, 2);
  std::vector<int> all(8);
  std::iota(all.begin(), all.end(), 0);
  std::vector<float> read;
  std::vector<HeightSource> sources;
  const absl::Status status = heights.Read(all, vertices, &read, &sources);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("control face 3 are damaged"));
}

}  // namespace
}  // namespace rilievo
