#include "core/surface/displaced_surface.h"

#include <cmath>

#include "core/geometry/mesh_topology.h"
#include "core/loop/refinement.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace rilievo {
namespace {

ControlMesh Octahedron() {
  ControlMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 1, -1, 0, 0, 0, 0,  //
      0, 0, 1, -1, 0, 0,               //
      0, 0, 0, 0, 1, -1;
  mesh.faces.resize(3, 8);
  mesh.faces << 0, 2, 1, 3, 2, 1, 3, 0,  //
      2, 1, 3, 0, 0, 2, 1, 3,            //
      4, 4, 4, 4, 5, 5, 5, 5;
  return mesh;
}

// A flat lattice of equilateral triangles in the plane z = 0, normals +z.
ControlMesh FlatLattice(int size) {
  ControlMesh mesh;
  mesh.vertices.resize(3, size * size);
  mesh.faces.resize(3, 2 * (size - 1) * (size - 1));
  int f = 0;
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      mesh.vertices.col(i * size + j) << 0.1 * (i + 0.5 * j), 0.1 * std::sqrt(0.75) * j, 0;
      if (i + 1 == size || j + 1 == size) continue;
      const int a = i * size + j, b = a + size;
      mesh.faces.col(f++) << a, b, a + 1;
      mesh.faces.col(f++) << b, b + 1, a + 1;
    }
  }
  return mesh;
}

ControlMesh QuadSquare() {
  ControlMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 1, 0,  //
      0, 0, 1, 1,               //
      0, 0, 0, 0;
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 2,  //
      1, 3,            //
      2, 0;
  mesh.diagonals = {{0, 2}};
  return mesh;
}

// Heights that put every vertex of the Loop surface of the octahedron on the sphere of radius r.
DisplacedSurface Sphere(double r, int level) {
  DisplacedSurface surface;
  surface.control_mesh = Octahedron();
  surface.max_level = level;
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, level, RunContext());
  const LimitSurface limit =
      *EvaluateLimit(refinement, surface.control_mesh.vertices, level, RunContext());
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    const Eigen::Vector3d p = limit.positions.col(v), n = limit.normals.col(v);
    const double b = p.dot(n);
    surface.heights.push_back(static_cast<float>(-b + std::sqrt(b * b - p.dot(p) + r * r)));
    surface.sources.push_back(v % 5 == 0 ? HeightSource::kFilled : HeightSource::kMeasured);
  }
  return surface;
}

TEST(TessellateTest, HeightsMakeASphere) {
  DisplacedSurface surface = Sphere(1.25, 4);
  surface.frame.center = {500000.25, 4600000.5, -12};
  surface.frame.diagonal = 40;
  for (int level = 0; level <= 4; ++level) {
    const auto mesh = Tessellate(surface, level, RunContext());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->triangles.cols(), 8 << (2 * level));
    EXPECT_EQ(SummarizeTopology(mesh->triangles, static_cast<int>(mesh->vertices.cols())).euler, 2);
    for (Eigen::Index v = 0; v < mesh->vertices.cols(); ++v) {
      const Eigen::Vector3d from_center = mesh->vertices.col(v) - surface.frame.center;
      EXPECT_NEAR(from_center.norm(), 1.25 * 40, 1e-5);
      EXPECT_GT(mesh->normals.col(v).dot(from_center.normalized()), level < 2 ? 0.9 : 0.99);
      EXPECT_NEAR(mesh->normals.col(v).norm(), 1, 1e-12);
    }
  }
}

TEST(TessellateTest, LevelsNest) {
  const DisplacedSurface surface = Sphere(1.1, 3);
  const TriangleMesh fine = *Tessellate(surface, 5, RunContext());
  for (int level = 0; level < 5; ++level) {
    const TriangleMesh coarse = *Tessellate(surface, level, RunContext());
    const auto same = fine.vertices.leftCols(coarse.vertices.cols());
    EXPECT_LT((coarse.vertices - same).cwiseAbs().maxCoeff(), 1e-12) << level;
  }
}

// Beyond the last level the domain stays exact and the heights of a smooth field follow closely.
TEST(TessellateTest, InterpolatesBeyondTheLastLevel) {
  const DisplacedSurface surface = Sphere(1.25, 3);
  const TriangleMesh mesh = *Tessellate(surface, 5, RunContext());
  double worst = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    worst = std::max(worst, std::abs(mesh.vertices.col(v).norm() - 1.25));
  }
  EXPECT_LT(worst, 1e-3);
}

TEST(TessellateTest, ReproducesQuadraticHeightsBeyondTheLastLevel) {
  DisplacedSurface surface;
  surface.control_mesh = FlatLattice(9);
  surface.max_level = 1;
  const TriangleMesh flat = [&] {
    DisplacedSurface domain = surface;
    const int count =
        (*RefineTopology(domain.control_mesh, 1, RunContext())).levels[1].vertex_count;
    domain.heights.assign(count, 0.0f);
    domain.sources.assign(count, HeightSource::kMeasured);
    return *Tessellate(domain, 1, RunContext());
  }();
  const auto height = [](double x, double y) { return 0.05 * x * x - 0.1 * x * y + 0.02 * y; };
  for (Eigen::Index v = 0; v < flat.vertices.cols(); ++v) {
    surface.heights.push_back(static_cast<float>(height(flat.vertices(0, v), flat.vertices(1, v))));
    surface.sources.push_back(HeightSource::kMeasured);
  }
  const TriangleMesh fine = *Tessellate(surface, 3, RunContext());
  int inside = 0;
  for (Eigen::Index v = 0; v < fine.vertices.cols(); ++v) {
    const Eigen::Vector3d p = fine.vertices.col(v);
    // Away from the boundary, where whole stencils exist and the lattice is regular.
    const double j = p[1] / (0.1 * std::sqrt(0.75)), i = p[0] / 0.1 - 0.5 * j;
    if (i < 2 || j < 2 || i > 6 || j > 6) continue;
    EXPECT_NEAR(p[2], height(p[0], p[1]), 1e-7);
    ++inside;
  }
  EXPECT_GT(inside, 500);
}

// By patches, and by the whole topology: at coarse levels, and of quads.
TEST(TessellateTest, TheUnitFrameHasTheSameTriangles) {
  for (const bool quads : {false, true}) {
    for (const int level : {0, 1, 3}) {
      DisplacedSurface surface = Sphere(1.25, level);
      if (quads) {
        surface.control_mesh = QuadSquare();
        const int64_t count =
            RefineTopology(surface.control_mesh, level, RunContext())->vertex_count(level);
        surface.heights.assign(count, 0.1f);
        surface.sources.assign(count, HeightSource::kMeasured);
      }
      surface.frame = {{10, 20, 30}, 7};
      const TriangleMesh mesh = *Tessellate(surface, level, RunContext());
      for (const bool with_normals : {false, true}) {
        const TriangleMesh unit =
            *TessellateInUnitFrame(surface, level, with_normals, RunContext());
        EXPECT_EQ(unit.triangles, mesh.triangles);
        EXPECT_EQ(unit.normals, with_normals ? mesh.normals : Eigen::Matrix3Xd(3, 0));
        for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
          EXPECT_EQ(surface.frame.ScanFromUnit(unit.vertices.col(v)), mesh.vertices.col(v));
        }
      }
    }
  }
}

TEST(TessellateTest, ThreadsDoNotChangeTheResult) {
  const DisplacedSurface surface = Sphere(1.25, 4);
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  const TriangleMesh a = *Tessellate(surface, 5, one), b = *Tessellate(surface, 5, two);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(TessellateTest, RefusesWhatDoesNotFit) {
  DisplacedSurface surface = Sphere(1.25, 2);
  for (int level : {-1, 5}) {
    const absl::Status status = Tessellate(surface, level, RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), ::testing::HasSubstr("level is"));
    EXPECT_TRUE(SourcesAtLevel(surface, level).empty());
  }
  surface.heights.pop_back();
  surface.sources.pop_back();
  EXPECT_THAT(Tessellate(surface, 1, RunContext()).status().message(),
              ::testing::HasSubstr("heights has 65 entries"));
}

TEST(SourcesAtLevelTest, NestAndPassOnTheLessTrusted) {
  const DisplacedSurface surface = Sphere(1.25, 2);
  EXPECT_EQ(SourcesAtLevel(surface, 2), surface.sources);
  const std::vector<HeightSource> coarse = SourcesAtLevel(surface, 0);
  EXPECT_EQ(coarse,
            std::vector<HeightSource>(surface.sources.begin(), surface.sources.begin() + 6));
  const std::vector<HeightSource> fine = SourcesAtLevel(surface, 3);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, 3, RunContext());
  const MeshTopology& topology = refinement.levels[2];
  ASSERT_EQ(static_cast<int>(fine.size()), refinement.levels[3].vertex_count);
  for (int e = 0; e < topology.edge_count(); ++e) {
    const bool filled =
        topology.edge_vertices(0, e) % 5 == 0 || topology.edge_vertices(1, e) % 5 == 0;
    EXPECT_EQ(fine[topology.vertex_count + e],
              filled ? HeightSource::kFilled : HeightSource::kMeasured);
  }
}

}  // namespace
}  // namespace rilievo
