#include "core/pipeline/face_parts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/loop/face_vertices.h"
#include "core/paging/scan_pager.h"

namespace rilievo {
namespace {

// A flat sheet of 8 by 8 quads with one control point far above it: with diagonals a Catmull-Clark
// surface, else a Loop surface of their triangles.
ControlMesh SheetWithSpike(bool in_quads) {
  constexpr int kQuads = 8, kRow = kQuads + 1;
  ControlMesh mesh;
  mesh.vertices.resize(3, kRow * kRow);
  mesh.faces.resize(3, 2 * kQuads * kQuads);
  for (int v = 0; v < kRow * kRow; ++v) {
    mesh.vertices.col(v) << double(v % kRow) / kQuads - 0.5, double(v / kRow) / kQuads - 0.5,
        v == kRow * kRow / 2 ? 1.0 : 0.0;
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

// How far the finest vertices lie outside of the reach of their faces, as `cutter` tells it.
double FarthestOutside(const DisplacedSurface& surface, const PartCutter& cutter) {
  ScanPager pager = ScanPager::Create(::testing::TempDir()).value();
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 100);
  EXPECT_TRUE(pager.Add(points).ok());
  const PagedScan scan = pager.Finish(RunContext{}).value();
  ScanSurface coarse{{}, {}, {}, PointIndex(points), {}, {}};
  coarse.cloud.median_spacing = 0.01;
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
  return outside;
}

TEST(FacePartsTest, TheSurfaceOfAFaceLiesWithinItsReach) {
  const ControlMesh triangles = SheetWithSpike(false);
  const PartCutter as_triangles = PartCutter::Make(triangles).value();
  DisplacedSurface surface;
  surface.max_level = 3;
  surface.heights.assign(VertexCountAt(as_triangles.topology(), surface.max_level), 0.0f);
  surface.sources.assign(surface.heights.size(), HeightSource::kMeasured);
  surface.control_mesh = triangles;
  EXPECT_LT(FarthestOutside(surface, as_triangles), 1e-12);
  surface.control_mesh = SheetWithSpike(true);
  EXPECT_LT(FarthestOutside(surface, PartCutter::Make(surface.control_mesh).value()), 1e-12);
  EXPECT_GT(FarthestOutside(surface, as_triangles), 1e-2) << "their triangles tell as much";
}

}  // namespace
}  // namespace rilievo
