#include "core/codec/mesh/face_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

struct Control {
  MeshTopology topology;
  std::vector<GridPoint> points;
};

Control ControlOf(const ControlMesh& mesh) {
  Control control;
  control.topology = *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  for (const auto& point : mesh.vertices.colwise()) {
    GridPoint& steps = control.points.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      steps[axis] = static_cast<int32_t>(std::lround(point[axis] * 1000));
    }
  }
  return control;
}

TEST(GroupFacesTest, PartsAllFacesIntoCompactHalves) {
  const Control control = ControlOf(Sheet(33, 33, false));  // 2 048 faces
  const FaceGroups groups = GroupFaces(control.topology, control.points, 300);
  ASSERT_EQ(groups.count(), 8);
  std::set<int> seen;
  for (int g = 0; g < groups.count(); ++g) {
    const std::vector<int>& members = groups.members[g];
    EXPECT_EQ(members.size(), 256u);
    EXPECT_TRUE(std::is_sorted(members.begin(), members.end()));
    for (size_t i = 0; i < members.size(); ++i) {
      EXPECT_EQ(groups.group_of[members[i]], g);
      EXPECT_EQ(groups.place_of[members[i]], static_cast<int>(i));
    }
    seen.insert(members.begin(), members.end());
    // A quarter of the sheet by a half: no group has more border than such a strip.
    int border = 0;
    for (int f : members) {
      for (int k = 0; k < 3; ++k) {
        const int neighbor = control.topology.face_neighbors(k, f);
        border += neighbor < 0 || groups.group_of[neighbor] != g;
      }
    }
    EXPECT_LE(border, 60);
  }
  EXPECT_EQ(seen.size(), 2048u);
}

TEST(GroupFacesTest, FacesInOnePlaceAreHalvedByTheirNumbers) {
  Control control = ControlOf(Sheet(13, 13, false));
  std::fill(control.points.begin(), control.points.end(), GridPoint{});
  const FaceGroups groups = GroupFaces(control.topology, control.points, 128);
  ASSERT_EQ(groups.count(), 4);
  EXPECT_EQ(groups.members[0].front(), 0);
  EXPECT_EQ(groups.members[0].back(), 71);
  EXPECT_EQ(groups.members[3].front(), 216);
}

// Each vertex of the finest level beyond the shared ones is one group's own, and each group's map
// takes it to the place it has on the control faces.
TEST(BuildGroupMeshTest, EveryVertexIsCodedOnce) {
  constexpr int kLevel = 3;
  for (const ControlMesh& mesh :
       {Torus(20, 10), Together(Sheet(12, 12, true), Octahedron(), Eigen::Vector3d(2, 0, 0))}) {
    const Control control = ControlOf(mesh);
    const FaceGroups groups = GroupFaces(control.topology, control.points, 100);
    ASSERT_GT(groups.count(), 2);
    const LoopRefinement whole = *RefineTopology(mesh, kLevel, RunContext());
    const FaceVertices numbers(whole.levels[0], kLevel);
    std::vector<int> owners(numbers.count(), 0);
    for (int g = 0; g < groups.count(); ++g) {
      const auto group = BuildGroupMesh(control.topology, groups, g, kLevel, RunContext());
      ASSERT_TRUE(group.ok()) << group.status();
      const std::vector<int> there = VerticesThere(
          FaceVertices(group->refinement.levels[0], kLevel), numbers, groups.members[g]);
      ASSERT_EQ(there.size(), group->foreign.size());
      const int shared = group->refinement.vertex_count(kFirstGroupedLevel - 1);
      for (int v = 0; v < static_cast<int>(there.size()); ++v) {
        ASSERT_GE(there[v], 0);
        if (v < shared) {
          EXPECT_EQ(group->foreign[v], 0);
        }
        owners[there[v]] += v >= shared && group->foreign[v] == 0;
      }
    }
    const int shared = whole.vertex_count(kFirstGroupedLevel - 1);
    EXPECT_TRUE(std::all_of(owners.begin(), owners.begin() + shared, [](int n) { return n == 0; }));
    EXPECT_TRUE(std::all_of(owners.begin() + shared, owners.end(), [](int n) { return n == 1; }));
  }
}

TEST(VerticesThereTest, FacesThatAreNotThereHaveNone) {
  const Control control = ControlOf(Octahedron());
  const FaceVertices numbers(control.topology, 2);
  std::vector<int> faces(8, -1);
  faces[3] = 3;
  const std::vector<int> there = VerticesThere(numbers, numbers, faces);
  std::vector<int> of_face;
  numbers.Of(3, of_face);
  for (int v = 0; v < static_cast<int>(there.size()); ++v) {
    const bool on_face = std::find(of_face.begin(), of_face.end(), v) != of_face.end();
    EXPECT_EQ(there[v], on_face ? v : -1);
  }
}

}  // namespace
}  // namespace rilievo
