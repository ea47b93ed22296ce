#include "core/surface/adaptive_tessellation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/mesh_topology.h"
#include "core/loop/loop_patches.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/measure_error.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

// A smooth mesh with waves on the side x > 0 only.
DisplacedSurface Wavy(ControlMesh mesh, int level) {
  DisplacedSurface surface;
  surface.control_mesh = std::move(mesh);
  surface.control_mesh.vertices *= 0.3;
  surface.frame = {.center = {4e5, 5e6, 10}, .diagonal = 50};
  surface.max_level = level;
  const auto refinement = RefineTopology(surface.control_mesh, level, RunContext());
  const auto limit = EvaluateLimit(*refinement, surface.control_mesh.vertices, level, RunContext());
  for (const auto p : limit->positions.colwise()) {
    const double bump = std::max(0.0, p.x());
    surface.heights.push_back(
        static_cast<float>(0.3 * bump * bump * std::sin(40 * p.y()) * std::cos(35 * p.z())));
    surface.sources.push_back(HeightSource::kMeasured);
  }
  return surface;
}

AdaptiveMesh WithTolerance(const DisplacedSurface& surface, double tolerance) {
  AdaptiveOptions options;
  options.tolerance = tolerance;
  auto adaptive = TessellateAdaptively(surface, options, RunContext());
  EXPECT_TRUE(adaptive.ok()) << adaptive.status();
  return *std::move(adaptive);
}

TEST(TessellateAdaptivelyTest, KeepsItsToleranceWithFewerTriangles) {
  const DisplacedSurface surface = Wavy(testing::Torus(12, 8), 4);
  const TriangleMesh finest = *Tessellate(surface, 4, RunContext());
  Eigen::Index before = finest.triangles.cols() + 1;
  for (double tolerance : {1e-4, 3e-4, 1e-3, 1e-2}) {
    const AdaptiveMesh adaptive = WithTolerance(surface, tolerance);
    const TriangleMesh& mesh = adaptive.mesh;
    EXPECT_LE(adaptive.error, tolerance);
    const auto error = MeasureTwoSided({finest.vertices, finest.triangles},
                                       {mesh.vertices, mesh.triangles}, {}, RunContext());
    EXPECT_LE(error->a_to_b.max, (1 + 1e-6) * tolerance * surface.frame.diagonal) << tolerance;
    EXPECT_LE(error->b_to_a.max, 1.5 * tolerance * surface.frame.diagonal) << tolerance;
    // The stated error is not an idle bound.
    EXPECT_GE(error->a_to_b.max, 0.8 * adaptive.error * surface.frame.diagonal) << tolerance;
    EXPECT_LT(mesh.triangles.cols(), before);
    before = mesh.triangles.cols();
    const TopologySummary topology =
        SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
    EXPECT_TRUE(topology.closed() && topology.manifold() && topology.oriented);
    EXPECT_EQ(topology.genus, 1);
  }
  EXPECT_LT(before, finest.triangles.cols() / 20);
}

TEST(TessellateAdaptivelyTest, VerticesAreThoseOfTheFinestLevelInOrder) {
  const DisplacedSurface surface = Wavy(testing::Torus(8, 6), 3);
  const TriangleMesh finest = *Tessellate(surface, 3, RunContext());
  const AdaptiveMesh adaptive = WithTolerance(surface, 1e-3);
  ASSERT_EQ(static_cast<Eigen::Index>(adaptive.vertices.size()), adaptive.mesh.vertices.cols());
  EXPECT_TRUE(std::is_sorted(adaptive.vertices.begin(), adaptive.vertices.end()));
  for (size_t v = 0; v < adaptive.vertices.size(); ++v) {
    const auto i = static_cast<Eigen::Index>(v);
    EXPECT_LT((adaptive.mesh.vertices.col(i) - finest.vertices.col(adaptive.vertices[v])).norm(),
              1e-8);
    EXPECT_EQ(adaptive.mesh.normals.col(i), finest.normals.col(adaptive.vertices[v]));
  }
}

TEST(TessellateAdaptivelyTest, IsFineWhereTheWavesAre) {
  const DisplacedSurface surface = Wavy(testing::Torus(12, 8), 4);
  const AdaptiveMesh adaptive = WithTolerance(surface, 1e-3);
  int waves = 0, calm = 0;
  for (const auto face : adaptive.mesh.triangles.colwise()) {
    const double x = adaptive.mesh.vertices(0, face[0]) - surface.frame.center.x();
    waves += x > 0.2 * surface.frame.diagonal;
    calm += x < -0.2 * surface.frame.diagonal;
  }
  EXPECT_GT(waves, 2 * calm);
}

TEST(TessellateAdaptivelyTest, ABudgetIsKeptAndUsed) {
  const DisplacedSurface surface = Wavy(testing::Torus(12, 8), 4);
  double before = 1;
  for (int64_t budget : {192, 500, 2000, 10000, 40000, 100000}) {
    AdaptiveOptions options;
    options.triangles = budget;
    const auto adaptive = TessellateAdaptively(surface, options, RunContext());
    ASSERT_TRUE(adaptive.ok()) << adaptive.status();
    EXPECT_LE(adaptive->mesh.triangles.cols(), budget);
    EXPECT_GE(adaptive->mesh.triangles.cols(), std::min<int64_t>(49152, budget) * 8 / 10) << budget;
    EXPECT_LT(adaptive->error, before) << budget;
    before = adaptive->error;
    EXPECT_TRUE(SummarizeTopology(adaptive->mesh.triangles,
                                  static_cast<int>(adaptive->mesh.vertices.cols()))
                    .closed());
  }
  EXPECT_EQ(before, 0);
}

TEST(TessellateAdaptivelyTest, OpenSurfacesKeepTheirBorder) {
  const DisplacedSurface surface = Wavy(testing::Grid(6, 5), 4);
  const AdaptiveMesh adaptive = WithTolerance(surface, 5e-4);
  const TopologySummary topology =
      SummarizeTopology(adaptive.mesh.triangles, static_cast<int>(adaptive.mesh.vertices.cols()));
  EXPECT_TRUE(topology.manifold());
  EXPECT_EQ(topology.boundary_loops, 1);
  EXPECT_EQ(topology.euler, 1);
}

TEST(TessellateAdaptivelyTest, LevelZeroIsGivenWhole) {
  const DisplacedSurface surface = Wavy(testing::Icosahedron(), 0);
  const AdaptiveMesh adaptive = WithTolerance(surface, 0.1);
  EXPECT_EQ(adaptive.mesh.triangles, surface.control_mesh.faces);
  EXPECT_EQ(adaptive.mesh.vertices, Tessellate(surface, 0, RunContext())->vertices);
}

TEST(TessellateAdaptivelyTest, ThreadsDoNotChangeIt) {
  const DisplacedSurface surface = Wavy(testing::Torus(8, 6), 3);
  AdaptiveOptions options;
  options.tolerance = 5e-4;
  RunContext one, four;
  one.threads = 1, four.threads = 4;
  const auto a = TessellateAdaptively(surface, options, one);
  const auto b = TessellateAdaptively(surface, options, four);
  EXPECT_EQ(a->mesh.vertices, b->mesh.vertices);
  EXPECT_EQ(a->mesh.triangles, b->mesh.triangles);
}

// Each point of the finest level within the angle, seen from the camera; near parts finer than the
// same shape far away; no cracks between.
TEST(TessellateAdaptivelyTest, FromACameraWhatIsNearIsFine) {
  DisplacedSurface surface = Wavy(testing::Torus(12, 8), 4);
  surface.heights.assign(surface.heights.size(), 0.0f);
  const TriangleMesh finest = *Tessellate(surface, 4, RunContext());
  const Eigen::Vector3d middle = finest.vertices.rowwise().mean();
  const double reach = (finest.vertices.row(0).array() - middle.x()).maxCoeff();
  AdaptiveOptions options;
  options.tolerance = 2e-3;
  options.camera = middle + Eigen::Vector3d(1.2 * reach, 0, 0);
  const AdaptiveMesh adaptive = *TessellateAdaptively(surface, options, RunContext());
  EXPECT_LE(adaptive.error, *options.tolerance);
  const TopologySummary topology =
      SummarizeTopology(adaptive.mesh.triangles, static_cast<int>(adaptive.mesh.vertices.cols()));
  EXPECT_TRUE(topology.closed() && topology.manifold() && topology.oriented);
  const ClosestPointTree tree =
      *ClosestPointTree::Build(adaptive.mesh.vertices, adaptive.mesh.triangles, RunContext());
  for (Eigen::Index v = 0; v < finest.vertices.cols(); v += 7) {
    const Eigen::Vector3d point = finest.vertices.col(v);
    EXPECT_LE(std::sqrt(tree.Closest(point).squared_distance),
              (1 + 1e-6) * *options.tolerance * (point - *options.camera).norm());
  }
  int near = 0, far = 0;
  for (const auto v : adaptive.mesh.vertices.colwise()) {
    ++(v.x() > middle.x() ? near : far);
  }
  EXPECT_GT(near, 2 * far);
  options.camera = Eigen::Vector3d(std::nan(""), 0, 0);
  EXPECT_EQ(TessellateAdaptively(surface, options, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(TessellateAdaptivelyTest, NamesWhatIsWrong) {
  const DisplacedSurface surface = Wavy(testing::Icosahedron(), 2);
  const auto message = [&](const AdaptiveOptions& options) {
    const auto status = TessellateAdaptively(surface, options, RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  AdaptiveOptions options;
  EXPECT_THAT(message(options), ::testing::HasSubstr("either"));
  options.triangles = 19;
  EXPECT_THAT(message(options), ::testing::HasSubstr("at least 20"));
  options.tolerance = 0.1;
  EXPECT_THAT(message(options), ::testing::HasSubstr("either"));
  options.triangles.reset();
  options.tolerance = std::nan("");
  EXPECT_THAT(message(options), ::testing::HasSubstr("tolerance is nan"));
}

}  // namespace
}  // namespace rilievo
