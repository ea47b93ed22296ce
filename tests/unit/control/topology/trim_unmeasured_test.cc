#include "core/control/topology/trim_unmeasured.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

// A square of kSide x kSide cells of two faces, one point on each vertex.
constexpr int kSide = 24;

ControlMesh Sheet() {
  ControlMesh mesh;
  mesh.vertices.resize(3, (kSide + 1) * (kSide + 1));
  mesh.faces.resize(3, 2 * kSide * kSide);
  for (int y = 0, v = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x) mesh.vertices.col(v++) = Eigen::Vector3d(x, y, 0) / kSide;
  }
  for (int y = 0, f = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int v = y * (kSide + 1) + x;
      mesh.faces.col(f++) << v, v + 1, v + kSide + 1;
      mesh.faces.col(f++) << v + 1, v + kSide + 2, v + kSide + 1;
    }
  }
  return mesh;
}

OrientedCloud PointsOf(const ControlMesh& mesh) {
  OrientedCloud cloud;
  cloud.points = mesh.vertices;
  cloud.normals = Eigen::Vector3d::UnitZ().replicate(1, mesh.vertices.cols());
  cloud.spacing.assign(mesh.vertices.cols(), 1.0f / kSide);
  cloud.median_spacing = 1.0 / kSide;
  return cloud;
}

// Marks the cells of [x0, x1) x [y0, y1).
void MarkBare(int x0, int x1, int y0, int y1, std::vector<float>* unmeasured) {
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      for (int half = 0; half < 2; ++half) (*unmeasured)[2 * (y * kSide + x) + half] = 1;
    }
  }
}

ControlMesh Cut(const ControlMesh& mesh, const std::vector<float>& unmeasured,
                const OrientedCloud& cloud) {
  return TrimUnmeasured(mesh, unmeasured, cloud, PointIndex(cloud.points), {}, RunContext{})
      .value();
}

ControlMesh Cut(const ControlMesh& mesh, const std::vector<float>& unmeasured) {
  return Cut(mesh, unmeasured, PointsOf(mesh));
}

std::vector<float> Nothing() { return std::vector<float>(2 * kSide * kSide, 0.0f); }

TEST(TrimUnmeasuredTest, AFaceIsUnmeasuredWhereNoPointsAre) {
  const ControlMesh sheet = Sheet();
  OrientedCloud cloud = PointsOf(sheet);
  std::vector<int> left;
  for (int v = 0; v < cloud.points.cols(); ++v) {
    if (cloud.points(0, v) < 0.5) left.push_back(v);
  }
  cloud.points = cloud.points(Eigen::all, left).eval();
  cloud.noise.assign(left.size(), 0.0f);
  const std::vector<float> unmeasured =
      UnmeasuredShares(sheet, cloud, PointIndex(cloud.points), RunContext{}).value();
  for (int f = 0; f < sheet.faces.cols(); ++f) {
    const double x = sheet.vertices(0, sheet.faces(0, f));
    if (x < 0.4 || x > 0.6) {
      EXPECT_NEAR(unmeasured[f], x < 0.5 ? 0 : 1, 1e-6) << f;
    }
  }
}

TEST(TrimUnmeasuredTest, ASmallHoleInsideStaysFilled) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(8, 14, 8, 14, &unmeasured);
  EXPECT_EQ(Cut(Sheet(), unmeasured).faces.cols(), 2 * kSide * kSide);
}

TEST(TrimUnmeasuredTest, AWideHoleBecomesAnOpening) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(4, 18, 4, 18, &unmeasured);
  const ControlMesh cut = Cut(Sheet(), unmeasured);
  EXPECT_EQ(cut.faces.cols(), 2 * (kSide * kSide - 14 * 14));
  const TopologySummary topology = SummarizeTopology(cut.faces, cut.vertices.cols());
  EXPECT_TRUE(topology.manifold());
  EXPECT_EQ(topology.boundary_loops, 2);
}

TEST(TrimUnmeasuredTest, AWideHoleWithAShortEnoughRimStaysFilled) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(4, 18, 4, 18, &unmeasured);
  const double rim = 4 * 14.0 / kSide;
  const OrientedCloud cloud = PointsOf(Sheet());
  for (const double longest : {0.99 * rim, 1.01 * rim}) {
    const ControlMesh cut = TrimUnmeasured(Sheet(), unmeasured, cloud, PointIndex(cloud.points),
                                           {.rim = longest}, RunContext{})
                                .value();
    EXPECT_EQ(cut.faces.cols() == 2 * kSide * kSide, longest > rim);
  }
}

// From border to border, between two halves.
TEST(TrimUnmeasuredTest, ABandThatJoinsWhatIsApartStaysWhereItIsNarrow) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(8, 14, 0, kSide, &unmeasured);
  const double width = 6.0 / kSide;
  const OrientedCloud cloud = PointsOf(Sheet());
  for (const double gap : {0.0, 0.6 * width, width}) {
    const ControlMesh cut = TrimUnmeasured(Sheet(), unmeasured, cloud, PointIndex(cloud.points),
                                           {.gap = gap}, RunContext{})
                                .value();
    EXPECT_EQ(cut.faces.cols() == 2 * kSide * kSide, gap >= width) << gap;
  }
  // At the border it joins nothing.
  unmeasured = Nothing();
  MarkBare(0, 3, 0, kSide, &unmeasured);
  EXPECT_LT(
      TrimUnmeasured(Sheet(), unmeasured, cloud, PointIndex(cloud.points), {.gap = 1}, RunContext{})
          ->faces.cols(),
      2 * kSide * kSide);
}

TEST(TrimUnmeasuredTest, StrayPointsVouchForNoWideHole) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(2, 22, 2, 22, &unmeasured);
  OrientedCloud cloud = PointsOf(Sheet());
  // A hole 28 edges wide is 9 wide where all points lie three edges apart, ...
  cloud.spacing.assign(cloud.spacing.size(), 3.1f / kSide);
  cloud.median_spacing = 3.1 / kSide;
  EXPECT_EQ(Cut(Sheet(), unmeasured, cloud).faces.cols(), 2 * kSide * kSide);
  // ... and an opening where most of the scan's lie much nearer to each other.
  cloud.median_spacing = 0.5 / kSide;
  EXPECT_EQ(Cut(Sheet(), unmeasured, cloud).faces.cols(), 2 * (kSide * kSide - 20 * 20));
}

TEST(TrimUnmeasuredTest, WhatHangsOverTheBoundaryIsCutHoweverNarrow) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(0, kSide, 0, 1, &unmeasured);
  EXPECT_EQ(Cut(Sheet(), unmeasured).faces.cols(), 2 * kSide * (kSide - 1));
}

TEST(TrimUnmeasuredTest, FacesThatArePartlyMeasuredStay) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(0, kSide, 0, 6, &unmeasured);
  for (float& share : unmeasured) share *= 0.7f;
  EXPECT_EQ(Cut(Sheet(), unmeasured).faces.cols(), 2 * kSide * kSide);
}

// Two openings that meet at a corner would leave a vertex with two fans.
TEST(TrimUnmeasuredTest, NoVertexIsPinched) {
  std::vector<float> unmeasured = Nothing();
  MarkBare(0, 12, 0, 12, &unmeasured);
  MarkBare(12, kSide, 12, kSide, &unmeasured);
  const ControlMesh cut = Cut(Sheet(), unmeasured);
  EXPECT_LT(cut.faces.cols(), kSide * kSide + 8);
  EXPECT_TRUE(BuildMeshTopology(cut.faces, static_cast<int>(cut.vertices.cols())).ok());
}

TEST(TrimUnmeasuredTest, TagsFollowTheirEdgesAndVertices) {
  ControlMesh mesh = Sheet();
  const int row = kSide + 1;
  mesh.creases = {{2, 3, 4.0f}, {20 * row + 4, 20 * row + 5, 7.0f}};
  mesh.corners = {2, 20 * row + 4};
  std::vector<float> unmeasured = Nothing();
  MarkBare(0, kSide, 0, 3, &unmeasured);
  const ControlMesh cut = Cut(mesh, unmeasured);
  ASSERT_EQ(cut.creases.size(), 1u);
  ASSERT_EQ(cut.corners.size(), 1u);
  EXPECT_EQ(cut.creases[0].sharpness, 7.0f);
  EXPECT_EQ(cut.vertices.col(cut.creases[0].a), mesh.vertices.col(20 * row + 4));
  EXPECT_EQ(cut.vertices.col(cut.creases[0].b), mesh.vertices.col(20 * row + 5));
  EXPECT_EQ(cut.corners[0], cut.creases[0].a);
}

TEST(TrimUnmeasuredTest, AMeshWithNothingMeasuredIsLeftAlone) {
  const std::vector<float> unmeasured(2 * kSide * kSide, 1.0f);
  EXPECT_EQ(Cut(Sheet(), unmeasured).faces.cols(), 2 * kSide * kSide);
}

}  // namespace
}  // namespace rilievo
