// Meshes as input: what comes of them, seen from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/codec/container/dss.h"
#include "core/control/settings.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/domain_of_mesh.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/shape_input.h"
#include "core/surface/displaced_surface.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

PointCloud MeshInput(const ControlMesh& mesh) { return {mesh.vertices, {}, mesh.faces}; }

// Both ways between the mesh and the surface, fraction of the diagonal.
TwoSidedError ErrorOf(const PointCloud& mesh, const Reconstruction& made) {
  const TriangleMesh surface =
      Tessellate(made.surface, made.surface.max_level, RunContext{}).value();
  Shape a{mesh.points, mesh.triangles}, b{surface.vertices, surface.triangles};
  TwoSidedError error = MeasureTwoSided(a, b, {}, RunContext{}).value();
  error.rms /= made.report.diagonal;
  error.max /= made.report.diagonal;
  return error;
}

// Of height 2 over a regular polygon with a radius of 1, closed below by a fan.
PointCloud Cone(int faces) {
  PointCloud cone;
  cone.points.resize(3, faces + 2);
  cone.triangles.resize(3, 2 * faces);
  cone.points.col(faces) << 0, 0, 2;
  cone.points.col(faces + 1) << 0, 0, 0;
  for (int i = 0; i < faces; ++i) {
    const double angle = 2 * std::numbers::pi * i / faces;
    cone.points.col(i) << std::cos(angle), std::sin(angle), 0;
    cone.triangles.col(2 * i) << i, (i + 1) % faces, faces;
    cone.triangles.col(2 * i + 1) << (i + 1) % faces, i, faces + 1;
  }
  return cone;
}

// Of radius 1 and height 1, closed by fans.
PointCloud Drum(int faces) {
  PointCloud drum;
  drum.points.resize(3, 2 * faces + 2);
  drum.triangles.resize(3, 4 * faces);
  drum.points.col(2 * faces) << 0, 0, 0;
  drum.points.col(2 * faces + 1) << 0, 0, 1;
  for (int i = 0; i < faces; ++i) {
    const double angle = 2 * std::numbers::pi * i / faces;
    const int next = (i + 1) % faces;
    drum.points.col(i) << std::cos(angle), std::sin(angle), 0;
    drum.points.col(faces + i) << std::cos(angle), std::sin(angle), 1;
    drum.triangles.middleCols<4>(4 * i) << i, i, next, faces + i,  //
        next, faces + next, i, faces + next,                       //
        faces + next, faces + i, 2 * faces, 2 * faces + 1;
  }
  return drum;
}

// Of few vertices.
ReconstructOptions Coarse() {
  ReconstructOptions options;
  options.max_level = 2;
  return options;
}

// The rims of a drum are where the mesh has them: nothing that heights could mend.
TEST(ShapeMeshTest, SharpEdgesAreMet) {
  const PointCloud drum = Drum(180);
  const auto made = Reconstruct(drum, {}, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->report.genus, 0);
  EXPECT_GT(made->surface.control_mesh.creases.size(), 30u);
  const TwoSidedError error = ErrorOf(drum, *made);
  EXPECT_LT(error.rms, 3e-5);
  EXPECT_LT(error.max, 3e-4);
}

TEST(ShapeMeshTest, TopologyAndBordersAreTheMeshs) {
  struct Case {
    ControlMesh mesh;
    int components, loops, genus;
  };
  ControlMesh opened = testing::Torus(40, 24);
  opened.faces = Eigen::Matrix3Xi(opened.faces.rightCols(opened.faces.cols() - 2));
  const Case cases[] = {
      {testing::Union(opened, testing::Icosahedron()), 2, 1, 1},
      {testing::Grid(6, 4), 1, 1, 0},
  };
  for (const Case& c : cases) {
    const auto made = Reconstruct(MeshInput(c.mesh), Coarse(), RunContext{});
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(made->report.components, c.components);
    EXPECT_EQ(made->report.boundary_loops, c.loops);
    EXPECT_EQ(made->report.genus, c.genus);
    EXPECT_EQ(made->report.topology, "mesh");
    EXPECT_EQ(made->report.mesh.triangles, c.mesh.faces.cols());
  }
}

TEST(ShapeMeshTest, SharpEdgesStaySharp) {
  const PointCloud box = MeshInput(testing::Box({0, 0, 0}, {3, 2, 1}));
  const auto made = Reconstruct(box, {}, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_FALSE(made->surface.control_mesh.creases.empty());
  const TwoSidedError error = ErrorOf(box, *made);
  EXPECT_LT(error.rms, 1e-4);
  EXPECT_LT(error.max, 2e-3);
  EXPECT_LT(made->surface.control_mesh.faces.cols(), 100) << "flat sides need no more";
  EXPECT_LT(made->report.encoded_bytes, 500);
}

// Where the control mesh is the mesh, heights mend the rounding of its vertices and nothing else.
TEST(ShapeMeshTest, HeightsOverTheMeshItselfAreRounding) {
  for (const auto& [growth, expect_heights] : {std::pair(1.0001, true), {1.02, false}}) {
    ShapedInput input = ShapeMesh(MeshInput(testing::Box({0, 0, 0}, {3, 2, 1})), nullptr, Coarse(),
                                  PipelineContext{})
                            .value();
    input.scan.cloud.points *= growth;
    Domain domain;
    domain.fit.control_mesh = ControlMeshOfFewTriangles(input.given_mesh, 1000).value();
    domain.is_given = true;
    domain.position_step = kPositionStep;
    const auto sampled = SampleHeights(input.scan, Topology::kMesh, std::move(domain),
                                       input.options, PipelineContext{});
    ASSERT_TRUE(sampled.ok()) << sampled.status();
    const std::vector<float>& heights = sampled->surface.heights;
    const float most = *std::max_element(heights.begin(), heights.end());
    EXPECT_LT(most, kPositionStep);
    EXPECT_EQ(most > 0, expect_heights);
  }
}

// A flat star: no point of its plane tells where its border runs.
TEST(ShapeMeshTest, AFlatSheetKeepsItsBorder) {
  constexpr int kRays = 60;
  PointCloud star;
  star.points.setZero(3, kRays + 1);
  star.triangles.resize(3, kRays);
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRays, radius = i % 2 == 0 ? 1 : 0.7;
    star.points.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0;
    star.triangles.col(i) << i, (i + 1) % kRays, kRays;
  }
  const auto made = Reconstruct(star, {}, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_LT(ErrorOf(star, *made).max, 5e-4);
}

// A vertex of so many triangles, seen at 0.4 % before its fan was cut into rings.
TEST(ShapeMeshTest, ATipOfManyTrianglesKeepsItsShape) {
  const PointCloud cone = Cone(5000);
  const auto made = Reconstruct(cone, {}, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_LT(ErrorOf(cone, *made).rms, 1e-4);
}

TEST(ShapeMeshTest, ColoursAreCarried) {
  PointCloud mesh = MeshInput(testing::Torus(40, 24));
  for (const auto point : mesh.points.colwise()) {
    mesh.sights.colors.push_back(point[0] > 0 ? Rgb{200, 20, 20} : Rgb{20, 20, 200});
  }
  const auto made = Reconstruct(mesh, Coarse(), RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_GT(made->report.color_bytes, 0);
  const DecodedSurface decoded = DecodeDss(made->encoded.Concatenate(), RunContext{}).value();
  const TriangleMesh surface =
      Tessellate(decoded.surface, decoded.surface.max_level, RunContext{}).value();
  ASSERT_EQ(decoded.surface.colors.size(), static_cast<size_t>(surface.vertices.cols()));
  int wrong = 0;
  for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
    if (std::abs(surface.vertices(0, v)) < 0.2) continue;  // between the two
    const Rgb& color = decoded.surface.colors[v];
    wrong += (color[0] > color[2]) != (surface.vertices(0, v) > 0);
  }
  EXPECT_EQ(wrong, 0);
}

TEST(ShapeMeshTest, TheFileIsConfirmedByItsMesh) {
  PointCloud mesh = MeshInput(testing::Torus(40, 24));
  const auto made = Reconstruct(mesh, {}, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  const DecodedSurface decoded = DecodeDss(made->encoded.Concatenate(), RunContext{}).value();
  EXPECT_TRUE(VerifyCertificate(decoded, &mesh, RunContext{})->agrees());
  std::swap(mesh.triangles(0, 0), mesh.triangles(1, 0));
  EXPECT_EQ(VerifyCertificate(decoded, &mesh, RunContext{})->scan, StatedScan::kOther);
}

TEST(ShapeMeshTest, ErrorsAreThoseFromItsTriangles) {
  const PointCloud mesh = MeshInput(testing::Torus(40, 24));
  ReconstructOptions options;
  options.control.target_faces = 3000;  // asked for: else the mesh is the surface
  const auto made = Reconstruct(mesh, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  const TwoSidedError& stated = made->report.error;
  const TwoSidedError measured = ErrorOf(mesh, *made);
  EXPECT_NEAR(stated.rms / measured.rms, 1, 0.1);
  // Its points are farther apart than the surface is away from it.
  EXPECT_LT(stated.a_to_b.max, 0.5 * made->report.median_spacing);
  EXPECT_EQ(stated.across_rms, std::max(stated.a_to_b.rms, stated.b_to_a.rms));
}

TEST(ShapeMeshTest, HolesWithAShortRimAreClosed) {
  ControlMesh opened = testing::Torus(40, 24);
  opened.faces = Eigen::Matrix3Xi(opened.faces.rightCols(opened.faces.cols() - 8));
  ReconstructOptions options = Coarse();
  const PointCloud mesh = MeshInput(opened);
  EXPECT_EQ(Reconstruct(mesh, options, RunContext{})->report.boundary_loops, 1);
  options.lengths.close_holes_below = 2;
  const auto made = Reconstruct(mesh, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->report.boundary_loops, 0);
  EXPECT_EQ(made->report.genus, 1);
  EXPECT_GT(made->report.heights_filled, 0);
  const DecodedSurface decoded = DecodeDss(made->encoded.Concatenate(), RunContext{}).value();
  EXPECT_TRUE(VerifyCertificate(decoded, &mesh, RunContext{})->agrees());
}

TEST(ShapeMeshTest, PiecesWithANarrowGapAreJoined) {
  ControlMesh apart = testing::Torus(40, 24);
  std::vector<int> kept;  // without two rings around the tube
  for (int f = 0; f < apart.faces.cols(); ++f) {
    if (f / 48 != 5 && f / 48 != 25) kept.push_back(f);
  }
  apart.faces = Eigen::Matrix3Xi(apart.faces(Eigen::all, kept));
  ReconstructOptions options = Coarse();
  const PointCloud mesh = MeshInput(apart);
  EXPECT_EQ(Reconstruct(mesh, options, RunContext{})->report.components, 2);
  options.lengths.bridge_gaps_below = 1;
  const auto made = Reconstruct(mesh, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->report.components, 1);
  EXPECT_EQ(made->report.boundary_loops, 0);
  EXPECT_EQ(made->report.genus, 1);
}

TEST(ShapeMeshTest, TheBytesDoNotDependOnTheThreads) {
  const PointCloud mesh = MeshInput(testing::Torus(30, 16));
  std::vector<uint8_t> bytes[2];
  for (const int threads : {1, 3}) {
    RunContext context;
    context.threads = threads;
    bytes[threads / 2] = Reconstruct(mesh, {}, context)->encoded.Concatenate();
  }
  EXPECT_EQ(bytes[0], bytes[1]);
}

TEST(ShapeMeshTest, AnErrorAskedForIsKept) {
  const PointCloud mesh = MeshInput(testing::Torus(60, 40));
  ReconstructOptions options;
  options.encode.max_error = 5e-4;
  options.control.target_faces = 500;  // else several are tried
  const auto made = Reconstruct(mesh, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_FALSE(made->report.error_unreachable);
  EXPECT_LT(ErrorOf(mesh, *made).rms, 5e-4);
}

// A bumpy cap over a half disc, its border in the planes z = 0 and x = 0 with two corners.
PointCloud HalfCap(int rings, int rays) {
  PointCloud cap;
  cap.points.resize(3, rings * (rays + 1) + 1);
  cap.triangles.resize(3, rays * (2 * rings - 1));
  cap.points.col(0) << 0, 0, 1;
  Eigen::Index t = 0;
  const auto at = [&](int ring, int ray) { return 1 + (ring - 1) * (rays + 1) + ray; };
  for (int ring = 1; ring <= rings; ++ring) {
    const double share = static_cast<double>(ring) / rings;
    for (int ray = 0; ray <= rays; ++ray) {
      const double angle = std::numbers::pi * (static_cast<double>(ray) / rays - 0.5);
      const double bump = 1 + 0.02 * std::sin(7 * angle) * std::sin(5 * share);
      cap.points.col(at(ring, ray)) << share * bump * std::cos(angle),
          share * bump * std::sin(angle), 1 - share * share;
      if (ray == 0 || ray == rays) cap.points(0, at(ring, ray)) = 0;
      if (ray == rays) continue;
      if (ring == 1) {
        cap.triangles.col(t++) << 0, at(1, ray), at(1, ray + 1);
      } else {
        cap.triangles.col(t++) << at(ring - 1, ray), at(ring, ray), at(ring, ray + 1);
        cap.triangles.col(t++) << at(ring - 1, ray), at(ring, ray + 1), at(ring - 1, ray + 1);
      }
    }
  }
  return cap;
}

TEST(ShapeMeshTest, BordersAreExactWhereThatIsAsked) {
  const PointCloud cap = HalfCap(10, 100);
  ReconstructOptions options;
  options.control.boundary = BoundaryRule::kExact;
  options.control.target_faces = 150;
  options.max_level = 1;
  options.measure = false;
  const auto made = Reconstruct(cap, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_GE(made->surface.control_mesh.corners.size(), 2u);
  const auto decoded = DecodeDss(made->encoded.Concatenate(), RunContext{});
  const TriangleMesh mesh =
      Tessellate(decoded->surface, decoded->surface.max_level, RunContext{}).value();
  const auto topology = BuildMeshTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
  double farthest = 0;
  int on_border = 0;
  for (int v = 0; v < topology->vertex_count; ++v) {
    if (topology->boundary_vertex[static_cast<size_t>(v)] == 0) continue;
    ++on_border;
    farthest =
        std::max(farthest, std::min(std::abs(mesh.vertices(2, v)), std::abs(mesh.vertices(0, v))));
  }
  EXPECT_GT(on_border, 100);
  EXPECT_LT(farthest, kControlOptions.exact_border * made->report.diagonal);
  // Its two corners are the surface's.
  for (const Eigen::Index corner : {cap.points.cols() - 101, cap.points.cols() - 1}) {
    const double off =
        (mesh.vertices.colwise() - cap.points.col(corner)).colwise().norm().minCoeff();
    EXPECT_LT(off, kControlOptions.exact_border * made->report.diagonal);
  }
  EXPECT_LT(ErrorOf(cap, *made).rms, 2e-4);
  // Of a scan there is no such border.
  EXPECT_THAT(Reconstruct({cap.points}, options, RunContext{}).status().message(),
              ::testing::HasSubstr("boundary: exact is for meshes"));
}

TEST(ShapeMeshTest, RefusesOptionsOfScans) {
  const PointCloud mesh = MeshInput(testing::Icosahedron());
  ReconstructOptions options;
  options.control.topology = Topology::kPlanar;
  EXPECT_THAT(Reconstruct(mesh, options, RunContext{}).status().message(),
              ::testing::HasSubstr("topology:"));
  options = {};
  options.control.boundary = BoundaryRule::kClose;
  EXPECT_THAT(Reconstruct(mesh, options, RunContext{}).status().message(),
              ::testing::HasSubstr("boundary:"));
  PointCloud broken = mesh;
  broken.triangles(0, 3) = 12;
  EXPECT_EQ(Reconstruct(broken, {}, RunContext{}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
