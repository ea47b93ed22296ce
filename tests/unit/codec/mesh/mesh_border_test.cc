#include "core/codec/mesh/mesh_border.h"

#include "gtest/gtest.h"

namespace rilievo {
namespace {

std::vector<int> Loop(const MeshBorder& border, int e) {
  std::vector<int> vertices;
  int at = e;
  do {
    vertices.push_back(border[at].vertex);
    EXPECT_EQ(border[border[at].next].prev, at);
    at = border[at].next;
  } while (at != e);
  return vertices;
}

MeshBorder OneTriangle() {
  MeshBorder border;
  const int tags[3] = {0, 1, 2};
  border.AddTriangle(0, 1, 2, tags);
  return border;
}

TEST(MeshBorderTest, ATetrahedronClosesToNothing) {
  MeshBorder border = OneTriangle();
  const int around = border.GlueNewVertex(0, 3, 10, 11);  // over 0 -> 1
  EXPECT_EQ(Loop(border, around), (std::vector<int>{0, 3, 1, 2}));
  ASSERT_TRUE(border.CanCloseLeft(around));
  border.GlueLeft(around, 12);  // 0 -> 3 and 2 -> 0: face 3 0 2
  EXPECT_EQ(border.live().size(), 3u);
  const int last = border.live()[0];
  border.GlueRight(last, 13);  // the last face; what is left zips
  EXPECT_TRUE(border.live().empty());
}

TEST(MeshBorderTest, AcrossSplitsALoop) {
  MeshBorder border = OneTriangle();
  int e = border.GlueNewVertex(0, 3, -1, -1);
  e = border.GlueNewVertex(e, 4, -1, -1);
  e = border.GlueNewVertex(e, 5, -1, -1);
  ASSERT_EQ(Loop(border, e), (std::vector<int>{0, 5, 4, 3, 1, 2}));
  int at = e;
  while (border[at].vertex != 3) at = border[at].next;
  const int left = border.GlueAcross(e, at, -1, -1);  // face 5 0 3
  EXPECT_EQ(Loop(border, left), (std::vector<int>{0, 3, 1, 2}));
  const int right = left + 1;
  EXPECT_EQ(Loop(border, right), (std::vector<int>{3, 5, 4}));
}

TEST(MeshBorderTest, AcrossJoinsTwoLoops) {
  MeshBorder border = OneTriangle();
  const int tags[3] = {-1, -1, -1};
  border.AddTriangle(7, 8, 9, tags);
  const int left = border.GlueAcross(0, 3, -1, -1);  // over 0 -> 1 to vertex 7
  EXPECT_EQ(Loop(border, left), (std::vector<int>{0, 7, 8, 9, 7, 1, 2}));
}

TEST(MeshBorderTest, BoundaryEdgesAreNeitherClosedOverNorZipped) {
  MeshBorder border = OneTriangle();
  border.MarkBoundary(1);
  EXPECT_FALSE(border.CanCloseRight(0));
  EXPECT_TRUE(border.CanCloseLeft(0));
  EXPECT_TRUE(border.Live(1));
  EXPECT_FALSE(border.Open(1));
  border.GlueLeft(0, -1);  // face 1 0 2 leaves 2 -> 1 opposite the boundary edge 1 -> 2
  EXPECT_EQ(border.live().size(), 2u);
}

}  // namespace
}  // namespace rilievo
