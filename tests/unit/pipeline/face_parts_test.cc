#include "core/pipeline/face_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "core/loop/face_vertices.h"
#include "core/paging/scan_pager.h"

namespace rilievo {
namespace {

// A sheet of 8 by 8 quads at random heights: with diagonals a Catmull-Clark surface, else a Loop
// surface of their triangles.
ControlMesh RoughSheet(bool in_quads) {
  constexpr int kQuads = 8, kRow = kQuads + 1;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> height(-0.3, 0.3);
  ControlMesh mesh;
  mesh.vertices.resize(3, kRow * kRow);
  mesh.faces.resize(3, 2 * kQuads * kQuads);
  for (int v = 0; v < kRow * kRow; ++v) {
    mesh.vertices.col(v) << double(v % kRow) / kQuads - 0.5, double(v / kRow) / kQuads - 0.5,
        height(random);
  }
  int f = 0;
  for (int y = 0; y < kQuads; ++y) {
    for (int x = 0; x < kQuads; ++x) {
      const int v = y * kRow + x, across = v + kRow + 1;
      mesh.faces.col(f++) << v, v + 1, across;
      mesh.faces.col(f++) << v, across, v + kRow;
      if (in_quads) mesh.diagonals.push_back({v, across});
    }
  }
  return mesh;
}

TEST(FacePartsTest, TheSurfaceOfAFaceLiesWithinItsReach) {
  ScanPager pager = ScanPager::Create(::testing::TempDir()).value();
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 100);
  ASSERT_TRUE(pager.Add(points).ok());
  const PagedScan scan = pager.Finish(RunContext{}).value();
  ScanSurface coarse{{}, {}, {}, PointIndex(points), {}, {}};
  coarse.cloud.median_spacing = 0.01;
  for (const bool in_quads : {false, true}) {
    DisplacedSurface surface;
    surface.control_mesh = RoughSheet(in_quads);
    surface.max_level = 3;
    const PartCutter cutter = PartCutter::Make(surface.control_mesh).value();
    surface.heights.assign(VertexCountAt(cutter.topology(), surface.max_level), 0.0f);
    surface.sources.assign(surface.heights.size(), HeightSource::kMeasured);
    const FaceParts parts(scan, coarse, surface, cutter, 4096);
    const TriangleMesh fine = Tessellate(surface, surface.max_level, RunContext{}).value();
    const FaceVertices vertices(cutter.topology(), surface.max_level);
    std::vector<int> of_face;
    double outside = 0;
    for (int f = 0; f < cutter.topology().face_count(); ++f) {
      const Eigen::AlignedBox3d reach = parts.ReachOf({f});
      vertices.Of(f, of_face);
      for (const int v : of_face) {
        outside = std::max(outside, reach.exteriorDistance(Eigen::Vector3d(fine.vertices.col(v))));
      }
    }
    EXPECT_LT(outside, 1e-12) << (in_quads ? "quads" : "triangles");
  }
}

}  // namespace
}  // namespace rilievo
