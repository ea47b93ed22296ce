#include "core/control/quads/improve_quads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Corners = std::array<int, 4>;

constexpr int kSquareColumns = 7, kSquareRows = 6;

int VertexAt(int column, int row) { return kSquareColumns * row + column; }

// Flat quads, all square.
std::vector<Corners> SquareQuads() {
  std::vector<Corners> quads;
  for (int row = 0; row + 1 < kSquareRows; ++row) {
    for (int column = 0; column + 1 < kSquareColumns; ++column) {
      quads.push_back({VertexAt(column, row), VertexAt(column + 1, row),
                       VertexAt(column + 1, row + 1), VertexAt(column, row + 1)});
    }
  }
  return quads;
}

Eigen::Matrix3Xd SquarePoints(int more = 0) {
  Eigen::Matrix3Xd points(3, kSquareColumns * kSquareRows + more);
  for (int v = 0; v < kSquareColumns * kSquareRows; ++v)
    points.col(v) << v % kSquareColumns, v / kSquareColumns, 0;
  return points;
}

PolygonSet SetOf(const Eigen::Matrix3Xd& points, const std::vector<Corners>& quads,
                 std::vector<Crease> creases = {}) {
  ControlMesh mesh;
  mesh.vertices = points;
  mesh.creases = std::move(creases);
  mesh.faces.resize(3, static_cast<Eigen::Index>(2 * quads.size()));
  Eigen::Index face = 0;
  for (const auto& [a, b, c, d] : quads) {
    mesh.faces.col(face++) << a, b, c;
    mesh.faces.col(face++) << a, c, d;
  }
  PolygonSet polygons(mesh);
  const int triangles = polygons.size();
  for (int p = 0; p < triangles; ++p) polygons.Remove(p);
  for (const Corners& quad : quads) polygons.Add(quad);
  return polygons;
}

// Takes quads out that are there, from any corner on.
void Exchange(const std::vector<Corners>& old, const std::vector<Corners>& made,
              std::vector<Corners>* quads) {
  for (Corners quad : old) {
    const auto is_it = [&](Corners other) {
      std::sort(other.begin(), other.end());
      return other == quad;
    };
    std::sort(quad.begin(), quad.end());
    const auto at = std::find_if(quads->begin(), quads->end(), is_it);
    ASSERT_NE(at, quads->end());
    quads->erase(at);
  }
  quads->insert(quads->end(), made.begin(), made.end());
}

// Of quads that are there.
std::vector<Corners> QuadsOf(const PolygonSet& polygons) {
  std::vector<Corners> quads;
  for (int p = 0; p < polygons.size(); ++p) {
    if (polygons[p].size == 0) continue;
    EXPECT_EQ(polygons[p].size, 4);
    Corners quad = polygons[p].corners;
    std::rotate(quad.begin(), std::min_element(quad.begin(), quad.end()), quad.end());
    quads.push_back(quad);
  }
  std::sort(quads.begin(), quads.end());
  return quads;
}

// The two quads at (2, 2) and (3, 2), with the edge between them turned.
std::vector<Corners> WithATurnedEdge() {
  std::vector<Corners> quads = SquareQuads();
  const int a = VertexAt(2, 2), b = VertexAt(3, 2), c = VertexAt(4, 2), d = VertexAt(4, 3),
            e = VertexAt(3, 3), f = VertexAt(2, 3);
  Exchange({{a, b, e, f}, {b, c, d, e}}, {{c, d, e, f}, {f, a, b, c}}, &quads);
  return quads;
}

std::vector<Corners> Sorted(const std::vector<Corners>& quads) {
  return QuadsOf(SetOf(SquarePoints(), quads));
}

TEST(ImproveQuadsTest, LeavesSquaresAsTheyAre) {
  PolygonSet polygons = SetOf(SquarePoints(), SquareQuads());
  ImproveQuads(&polygons);
  EXPECT_EQ(QuadsOf(polygons), Sorted(SquareQuads()));
}

TEST(ImproveQuadsTest, TurnsAnEdgeForTheValences) {
  PolygonSet polygons = SetOf(SquarePoints(), WithATurnedEdge());
  EXPECT_EQ(polygons.Valence(VertexAt(4, 2)), 5);
  EXPECT_EQ(polygons.Valence(VertexAt(3, 2)), 3);
  ImproveQuads(&polygons);
  EXPECT_EQ(QuadsOf(polygons), Sorted(SquareQuads()));
}

TEST(ImproveQuadsTest, CreasesStay) {
  const std::vector<Crease> creases = {{VertexAt(4, 2), VertexAt(2, 3), 2.0f}};
  PolygonSet polygons = SetOf(SquarePoints(), WithATurnedEdge(), creases);
  ImproveQuads(&polygons);
  EXPECT_TRUE(polygons.HasEdge(VertexAt(4, 2), VertexAt(2, 3)));
}

// All edges of a vertex lead to the opposite corners of its quads; its neighbours have three edges.
TEST(ImproveQuadsTest, TurnsAllEdgesOfAVertex) {
  std::vector<Corners> quads = SquareQuads();
  const auto at = [](int column, int row) { return VertexAt(3 + column, 2 + row); };
  const std::array<int, 4> ends = {at(1, 0), at(0, 1), at(-1, 0), at(0, -1)},
                           opposite = {at(1, 1), at(-1, 1), at(-1, -1), at(1, -1)};
  std::vector<Corners> before, after;
  for (size_t i = 0; i < 4; ++i) {
    before.push_back({at(0, 0), ends[i], opposite[i], ends[(i + 1) % 4]});
    after.push_back({at(0, 0), opposite[(i + 3) % 4], ends[i], opposite[i]});
  }
  Exchange(before, after, &quads);
  PolygonSet polygons = SetOf(SquarePoints(), quads);
  EXPECT_EQ(polygons.Valence(ends[0]), 3);
  EXPECT_EQ(polygons.Valence(opposite[0]), 5);
  ImproveQuads(&polygons);
  EXPECT_EQ(QuadsOf(polygons), Sorted(SquareQuads()));
}

// A vertex in the middle of a quad, with edges to two of its corners.
PolygonSet WithATip(double height) {
  std::vector<Corners> quads = SquareQuads();
  const int x = VertexAt(2, 2), y = VertexAt(3, 2), z = VertexAt(3, 3), w = VertexAt(2, 3);
  const int tip = kSquareColumns * kSquareRows;
  Exchange({{x, y, z, w}}, {{y, z, tip, x}, {tip, z, w, x}}, &quads);
  Eigen::Matrix3Xd points = SquarePoints(1);
  points.col(tip) << 2.5, 2.5, height;
  return SetOf(points, quads);
}

TEST(ImproveQuadsTest, TakesOutAVertexOfTwoEdges) {
  PolygonSet polygons = WithATip(0.05);
  ImproveQuads(&polygons);
  EXPECT_EQ(QuadsOf(polygons), Sorted(SquareQuads()));
}

TEST(ImproveQuadsTest, TheTipOfAConeStays) {
  PolygonSet polygons = WithATip(2);
  ImproveQuads(&polygons);
  EXPECT_EQ(polygons.Valence(kSquareColumns * kSquareRows), 2);
}

}  // namespace
}  // namespace rilievo
