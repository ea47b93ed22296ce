#include "core/codec/heights/group_heights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

// One group that is the whole octahedron: 8 faces, 6 vertices; 18, 66 and 258 with the levels.
GroupMesh OneGroup(int max_level) {
  const ControlMesh mesh = Octahedron();
  const MeshTopology topology = *BuildMeshTopology(mesh.faces, 6);
  const FaceGroups groups = GroupFaces(topology, std::vector<GridPoint>(6), 128);
  return *BuildGroupMesh(topology, groups, 0, max_level, RunContext());
}

HeightState SharedState() {
  HeightState state;
  state.heights.assign(18, 5);
  state.coefficients.assign(18, 1);
  state.filled.assign(18, 0);
  state.active = {std::vector<uint8_t>(8, 1)};
  return state;
}

TEST(StateOfGroupTest, GathersVerticesAndFaces) {
  HeightState whole;
  whole.heights = {10, 11, 12, 13};
  whole.coefficients = {0, 1, 2, 3};
  whole.filled = {0, 1, 0, 1};
  whole.active = {{1, 0, 1}};
  const HeightState part = StateOfGroup(whole, {2, 1}, {3, 0, 1});
  EXPECT_EQ(part.heights, (std::vector<int32_t>{13, 10, 11}));
  EXPECT_EQ(part.coefficients, (std::vector<int32_t>{3, 0, 1}));
  EXPECT_EQ(part.filled, (std::vector<uint8_t>{1, 0, 1}));
  EXPECT_EQ(part.active, (std::vector<std::vector<uint8_t>>{{1, 0}}));
}

TEST(DecodeGroupTest, NoPiecesAreNoCoefficients) {
  const GroupMesh mesh = OneGroup(3);
  std::vector<GroupedLayout> levels(2);
  for (GroupedLayout& level : levels) level.pieces.resize(1);
  const auto decoded = DecodeGroup(mesh, levels, true, HeightModels(), SharedState());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->values, std::vector<int32_t>(258, 0));
  EXPECT_EQ(decoded->filled, std::vector<uint8_t>(258, 0));
}

TEST(DecodeGroupTest, DamagedPiecesAreNamed) {
  const GroupMesh mesh = OneGroup(2);
  const std::vector<uint8_t> piece = {0, 1, 2, 3, 4, 5, 6, 7};
  std::vector<GroupedLayout> levels(1);
  levels[0].pieces = {piece};
  const auto decoded = DecodeGroup(mesh, levels, false, HeightModels(), SharedState());
  EXPECT_EQ(decoded.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(decoded.status().message(), HasSubstr("group 0 of level 2"));
}

TEST(GroupedLayoutTest, ComesBackAndNoticesEveryFlippedBit) {
  const std::vector<std::vector<uint8_t>> pieces = {{0, 1, 2, 9}, {}, {128, 7}};
  const std::vector<uint8_t> payload = WriteGroupedLayout({2, 11}, 300, pieces);
  const auto layout = ReadGroupedLayout(payload, 4, 3);
  ASSERT_TRUE(layout.ok()) << layout.status();
  EXPECT_EQ(layout->lifting.rule, 2);
  EXPECT_EQ(layout->lifting.strength, 11);
  EXPECT_EQ(layout->step, 300);
  ASSERT_EQ(layout->pieces.size(), 3u);
  EXPECT_TRUE(layout->pieces[1].empty());
  const auto first = ReadPieceLayout(layout->pieces[0], 4, 0);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_FALSE(first->empty);
  EXPECT_EQ(first->draw, (std::array<int, 2>{1, 2}));
  ASSERT_EQ(first->coded.size(), 1u);
  EXPECT_EQ(first->coded[0], 9);
  EXPECT_TRUE(ReadPieceLayout(layout->pieces[2], 4, 2)->empty);
  EXPECT_FALSE(ReadGroupedLayout(payload, 4, 4).ok());
  for (size_t bit = 0; bit < 8 * payload.size(); ++bit) {
    std::vector<uint8_t> spoiled = payload;
    spoiled[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8);
    const auto read = ReadGroupedLayout(spoiled, 4, 3);
    bool whole = read.ok();
    for (size_t g = 0; whole && g < 3; ++g) {
      whole =
          read->pieces[g].empty() || ReadPieceLayout(read->pieces[g], 4, static_cast<int>(g)).ok();
    }
    EXPECT_FALSE(whole) << "bit " << bit;
  }
}

}  // namespace
}  // namespace rilievo
