#include "core/control/quads/quad_control_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "core/control/simplify/simplify_mesh.h"
#include "core/control/topology/mesh_subset.h"
#include "core/loop/refinement.h"
#include "tests/unit/control/control_test_meshes.h"
#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

ControlMesh Quads(const ControlMesh& mesh) {
  auto made = QuadControlMesh(mesh);
  EXPECT_TRUE(made.ok()) << made.status();
  return *std::move(made);
}

// Edges of quads at each vertex.
std::vector<int> QuadValences(const ControlMesh& mesh) {
  const auto refinement = RefineTopology(mesh, 0, RunContext());
  EXPECT_TRUE(refinement.ok()) << refinement.status();
  const MeshTopology& topology = refinement->levels[0];
  std::vector<int> valences = topology.valence;
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (refinement->quads.levels[0].diagonal[e] == 0) continue;
    for (int end = 0; end < 2; ++end) --valences[topology.edge_vertices(end, e)];
  }
  return valences;
}

double ShareOfThreeToFive(const ControlMesh& mesh) {
  const std::vector<int> valences = QuadValences(mesh);
  const auto good =
      std::count_if(valences.begin(), valences.end(), [](int n) { return n >= 3 && n <= 5; });
  return static_cast<double>(good) / static_cast<double>(valences.size());
}

ControlMesh SimplifiedSphere(int faces) {
  SimplifyOptions options;
  options.target_faces = faces;
  return *SimplifyMesh(MarchTetrahedra(SphereField, 24), options, RunContext());
}

TEST(QuadControlMesh, OfAClosedMeshHasItsVerticesAndNineteenOfTwentyOfValenceThreeToFive) {
  const ControlMesh mesh = SimplifiedSphere(600);
  const ControlMesh quads = Quads(mesh);
  EXPECT_LE(quads.vertices.cols(), mesh.vertices.cols());
  EXPECT_GE(quads.vertices.cols(), 0.99 * static_cast<double>(mesh.vertices.cols()));
  EXPECT_GE(ShareOfThreeToFive(quads), 0.95);
  const TopologySummary summary = Summary(quads);
  EXPECT_TRUE(summary.manifold() && summary.oriented && summary.closed());
  EXPECT_EQ(summary.euler, 2);
  // Every quad, two faces, is turned outwards.
  for (Eigen::Index f = 0; f < quads.faces.cols(); f += 2) {
    const Vector3d a = quads.vertices.col(quads.faces(0, f)),
                   b = quads.vertices.col(quads.faces(1, f)),
                   c = quads.vertices.col(quads.faces(2, f)),
                   d = quads.vertices.col(quads.faces(2, f + 1));
    EXPECT_GT((c - a).cross(d - b).dot(a + b + c + d - 4 * kOffset), 0);
  }
  EXPECT_EQ(Quads(mesh).faces, quads.faces);
}

// An odd number of triangles: the boundary gets a vertex.
TEST(QuadControlMesh, OfAnOddSheetKeepsItsBorder) {
  ControlMesh mesh = Sheet(7, 7, false, [](double s, double t) -> Vector3d { return {s, t, 0}; });
  mesh.faces = mesh.faces.rightCols(mesh.faces.cols() - 1).eval();
  ASSERT_EQ(mesh.faces.cols() % 2, 1);
  const TopologySummary before = Summary(mesh);
  const ControlMesh quads = Quads(mesh);
  const TopologySummary after = Summary(quads);
  EXPECT_EQ(after.boundary_loops, before.boundary_loops);
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.boundary_edges, before.boundary_edges + 1);
  EXPECT_GT(ShareOfThreeToFive(quads), 0.8);
}

// Triangles on either side of a crease are odd in number: the crease gets a vertex, and stays one
// line of the same sharpness.
TEST(QuadControlMesh, CreasesStayEdges) {
  ControlMesh mesh = Sheet(7, 7, false, [](double s, double t) -> Vector3d { return {s, t, 0}; });
  const double middle = 0.5;
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  for (int e = 0; e < topology->edge_count(); ++e) {
    const auto ends = topology->edge_vertices.col(e);
    if (mesh.vertices(1, ends[0]) != middle || mesh.vertices(1, ends[1]) != middle) continue;
    mesh.creases.push_back({ends[0], ends[1], 2.5f});
  }
  SortTags(&mesh.creases, &mesh.corners);
  ASSERT_EQ(mesh.creases.size(), 6u);
  // Without one triangle on each side.
  mesh.faces = mesh.faces.middleCols(1, mesh.faces.cols() - 2).eval();
  const ControlMesh quads = Quads(mesh);
  EXPECT_GE(quads.creases.size(), 6u);
  double length = 0;
  for (const Crease& crease : quads.creases) {
    EXPECT_EQ(crease.sharpness, 2.5f);
    EXPECT_EQ(quads.vertices(1, crease.a), middle);
    EXPECT_EQ(quads.vertices(1, crease.b), middle);
    length += std::abs(quads.vertices(0, crease.a) - quads.vertices(0, crease.b));
  }
  EXPECT_NEAR(length, 1, 1e-12);
}

// Full of creases and of vertices of valence 3, where edges are short of room to turn.
ControlMesh SmallMesh(uint64_t seed) {
  testing::Random random(seed);
  ControlMesh mesh = seed % 3 == 0 ? testing::Grid(3, 4) : testing::Torus(3, 3);
  mesh = testing::SplitRandomFaces(mesh, static_cast<int>(seed % 13), random);
  return testing::WithRandomCreases(testing::Perturbed(mesh, 0.05, random), 0.3,
                                    {kInfiniteSharpness, 1.5f}, static_cast<int>(seed % 4), random);
}

bool IsSplit(const ControlMesh& quads, const ControlMesh& mesh) {
  return quads.vertices.cols() > 2 * mesh.vertices.cols();
}

// One that cannot be paired has three quads for each triangle.
TEST(QuadControlMesh, OfAnyMeshIsOneOfQuads) {
  int split = 0;
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    const ControlMesh mesh = SmallMesh(seed);
    const ControlMesh quads = Quads(mesh);
    const TopologySummary before = Summary(mesh), after = Summary(quads);
    EXPECT_EQ(after.euler, before.euler) << seed;
    EXPECT_EQ(after.boundary_loops, before.boundary_loops) << seed;
    EXPECT_EQ(quads.corners.size(), mesh.corners.size()) << seed;
    EXPECT_GE(quads.creases.size(), mesh.creases.size()) << seed;
    QuadValences(quads);  // refines
    split += IsSplit(quads, mesh) ? 1 : 0;
  }
  EXPECT_GT(split, 0);
  EXPECT_LT(split, 10);
}

// Beside a mesh that cannot be paired a sphere is what it is alone.
TEST(QuadControlMesh, PairsEachComponentByItself) {
  uint64_t seed = 1;
  while (seed < 60 && !IsSplit(Quads(SmallMesh(seed)), SmallMesh(seed))) ++seed;
  const ControlMesh small = SmallMesh(seed), sphere = SimplifiedSphere(200);
  ControlMesh both = testing::Union(small, sphere);
  both.creases = small.creases;
  both.corners = small.corners;
  const ControlMesh first = Quads(small), second = Quads(sphere), quads = Quads(both);
  ASSERT_TRUE(IsSplit(first, small));
  const int shift = static_cast<int>(first.vertices.cols());
  EXPECT_EQ(quads.vertices.cols(), shift + second.vertices.cols());
  const Eigen::Matrix3Xi of_sphere = quads.faces.rightCols(second.faces.cols()).array() - shift;
  EXPECT_EQ(of_sphere, second.faces);
  EXPECT_EQ(quads.faces.leftCols(first.faces.cols()), first.faces);
  EXPECT_EQ(quads.creases, first.creases);
  EXPECT_EQ(quads.corners, first.corners);
  QuadValences(quads);  // refines
}

TEST(QuadControlMesh, APartOfWholeQuadsIsOneOfQuads) {
  const ControlMesh quads = Quads(SimplifiedSphere(600));
  std::vector<float> of_face;
  for (const auto face : quads.faces.colwise()) {
    of_face.push_back(static_cast<float>(quads.vertices(0, face.minCoeff())));
  }
  const float sum = std::accumulate(of_face.begin(), of_face.end(), 0.0F);
  ShareBetweenHalves(quads, &of_face);
  EXPECT_NEAR(std::accumulate(of_face.begin(), of_face.end(), 0.0F), sum, 1e-3);
  std::vector<uint8_t> keep;
  for (const float value : of_face) keep.push_back(value > kOffset[0] ? 1 : 0);
  const ControlMesh part = KeepFaces(quads, keep).mesh;
  ASSERT_LT(part.faces.cols(), 0.8 * static_cast<double>(quads.faces.cols()));
  EXPECT_EQ(2 * static_cast<Eigen::Index>(part.diagonals.size()), part.faces.cols());
  const auto refinement = RefineTopology(part, 1, RunContext());
  EXPECT_TRUE(refinement.ok()) << refinement.status();
}

TEST(QuadControlMesh, RefusesQuads) {
  const ControlMesh quads = Quads(SimplifiedSphere(200));
  EXPECT_THAT(std::string(QuadControlMesh(quads).status().message()),
              ::testing::HasSubstr("quads already"));
}

}  // namespace
}  // namespace rilievo
