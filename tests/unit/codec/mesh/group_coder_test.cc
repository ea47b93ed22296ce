#include "core/codec/mesh/group_coder.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

MeshTopology TopologyOf(const ControlMesh& mesh) {
  return *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
}

FaceGroups Grouped(const ControlMesh& mesh, const MeshTopology& topology, int limit) {
  std::vector<GridPoint> points;
  for (const auto& point : mesh.vertices.colwise()) {
    GridPoint& steps = points.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      steps[axis] = static_cast<int32_t>(std::lround(point[axis] * 1000));
    }
  }
  return GroupFaces(topology, points, limit);
}

TEST(GroupCoderTest, GroupsComeBackInAFewBitsAFace) {
  const ControlMesh sheet = Sheet(33, 33, true);
  for (const ControlMesh& mesh : {sheet, Together(sheet, Torus(12, 16), {0, 0, 1})}) {
    const ControlMesh prepared = *PrepareControlMesh(mesh, 1e-3);
    const MeshTopology topology = TopologyOf(prepared);
    const FaceGroups groups = Grouped(prepared, topology, 256);
    const std::vector<uint8_t> bytes = EncodeGroups(groups, topology);
    EXPECT_LT(8 * bytes.size(), prepared.faces.cols());
    const auto decoded = DecodeGroups(bytes, topology, 256);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->members, groups.members);
    EXPECT_EQ(decoded->group_of, groups.group_of);
    EXPECT_EQ(decoded->place_of, groups.place_of);
  }
}

TEST(GroupCoderTest, GroupsThatHalvingDoesNotGiveAreDataLoss) {
  const ControlMesh mesh = *PrepareControlMesh(Sheet(33, 33, false), 1e-3);
  const MeshTopology topology = TopologyOf(mesh);
  const FaceGroups groups = Grouped(mesh, topology, 256);
  const std::vector<uint8_t> bytes = EncodeGroups(groups, topology);
  EXPECT_TRUE(absl::IsDataLoss(DecodeGroups(bytes, topology, 255).status()));
  EXPECT_TRUE(absl::IsDataLoss(DecodeGroups(bytes, topology, 513).status()));
  EXPECT_TRUE(absl::IsDataLoss(DecodeGroups({}, topology, 256).status()));
  for (const size_t kept : {size_t{1}, bytes.size() / 4}) {
    EXPECT_TRUE(
        absl::IsDataLoss(DecodeGroups(std::span(bytes).first(kept), topology, 256).status()));
  }
  for (const uint8_t count : {0, 255}) {
    std::vector<uint8_t> spoiled = bytes;
    spoiled[0] = count;
    if (count > 127) spoiled.insert(spoiled.begin() + 1, 127);  // 16 383 groups
    EXPECT_TRUE(absl::IsDataLoss(DecodeGroups(spoiled, topology, 256).status()));
  }
}

}  // namespace
}  // namespace rilievo
