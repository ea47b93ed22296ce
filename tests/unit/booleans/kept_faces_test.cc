#include "core/booleans/kept_faces.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

struct Cut {
  std::array<GridSolid, 2> solids;
  SolidCrossings crossings;
  KeptFaces kept;
};

absl::StatusOr<Cut> Keep(const TriangleMesh& a, const TriangleMesh& b, const KeptOutside& outside) {
  Cut cut;
  cut.solids = PlaceOnGrid(a, b, {}, RunContext()).value();
  cut.crossings = FindCrossings(cut.solids, RunContext()).value();
  auto kept = KeepFaces(cut.solids, cut.crossings, outside, RunContext());
  if (!kept.ok()) return kept.status();
  cut.kept = *std::move(kept);
  return cut;
}

// Each half-edge of what stays has one across, of the same side or, along the cut, of the other:
// with the second solid turned over where one inside stays and the other outside.
void ExpectClosed(const Cut& cut, bool turn_second) {
  std::map<std::pair<int, int>, int> half_edges;
  std::map<int, int> diagonals;
  for (size_t side = 0; side < 2; ++side) {
    for (const CutTriangle& triangle : cut.kept.triangles[side]) {
      for (size_t k = 0; k < 3; ++k) {
        int from = triangle.corners[k], to = triangle.corners[(k + 1) % 3];
        if (side == 1 && turn_second) std::swap(from, to);
        if (triangle.diagonals[k] >= 0) {
          ++diagonals[triangle.diagonals[k]];
        } else {
          EXPECT_EQ((++half_edges[{from, to}]), 1);
        }
      }
    }
  }
  for (const auto& [half_edge, uses] : half_edges) {
    EXPECT_EQ(half_edges.count({half_edge.second, half_edge.first}), 1u);
  }
  for (const auto& [diagonal, uses] : diagonals) EXPECT_EQ(uses, 2) << diagonal;
}

TEST(KeptFacesTest, WhatStaysIsClosed) {
  std::mt19937_64 random(9);
  const TriangleMesh shapes[] = {SphereMesh(3), TorusMesh(1, .4, 16, 9), UnitBox(-.5, -.5, -.5)};
  int64_t cut_faces = 0;
  for (int i = 0; i < 18; ++i) {
    const TriangleMesh a = Moved(shapes[i % 3], RandomPose(.6, random)),
                       b = Moved(shapes[i / 3 % 3], RandomPose(.6, random));
    for (const KeptOutside& outside :
         {KeptOutside{true, true}, KeptOutside{false, false}, KeptOutside{true, false}}) {
      SCOPED_TRACE(i);
      const auto cut = Keep(a, b, outside);
      ASSERT_TRUE(cut.ok()) << cut.status();
      ExpectClosed(*cut, outside[0] != outside[1]);
      cut_faces += cut->kept.cut_faces;
    }
  }
  EXPECT_GT(cut_faces, 500);
}

TEST(KeptFacesTest, SolidsApartStayWholeOrGo) {
  const TriangleMesh a = UnitBox(0, 0, 0), b = UnitBox(3, 0, 0);
  const auto both = Keep(a, b, {true, true}), none = Keep(a, b, {false, false});
  ASSERT_TRUE(both.ok() && none.ok());
  EXPECT_EQ(both->kept.triangles[0].size(), 12u);
  EXPECT_EQ(both->kept.triangles[1].size(), 12u);
  EXPECT_EQ(both->kept.triangles[1][0].corners[0], 8 + b.triangles(0, 0));
  EXPECT_TRUE(none->kept.triangles[0].empty() && none->kept.triangles[1].empty());
  EXPECT_EQ(both->kept.cut_faces, 0);
}

// A large face around a fine loop gets points of its own, as means of its corners.
TEST(KeptFacesTest, PointsAreAddedWithinTheirFaces) {
  const TriangleMesh box = BoxMesh({-2, -2, -2}, {2, 2, 0.1});
  const auto cut = Keep(box, SphereMesh(4), {true, false});
  ASSERT_TRUE(cut.ok());
  EXPECT_GT(cut->kept.added.size(), 20u);
  for (const AddedPoint& point : cut->kept.added) {
    EXPECT_NEAR(point.weights.sum(), 1, 1e-9);
    EXPECT_GT(point.weights.minCoeff(), -1e-9);
    for (const int corner : point.corners) EXPECT_LT(corner, 8);
  }
}

}  // namespace
}  // namespace rilievo
