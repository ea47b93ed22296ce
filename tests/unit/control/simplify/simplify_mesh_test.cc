#include "core/control/simplify/simplify_mesh.h"

#include <gtest/gtest.h>

#include "core/control/simplify/relax_mesh.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

void ExpectSameTopology(const ControlMesh& result, const ControlMesh& input) {
  const TopologySummary is = Summary(result), was = Summary(input);
  EXPECT_TRUE(is.manifold());
  EXPECT_TRUE(is.oriented);
  EXPECT_EQ(is.components, was.components);
  EXPECT_EQ(is.genus, was.genus);
  EXPECT_EQ(is.boundary_loops, was.boundary_loops);
  EXPECT_EQ(is.euler, was.euler);
  EXPECT_EQ(is.vertices, result.vertices.cols());
}

ControlMesh SimplifiedTo(const ControlMesh& mesh, int target_faces) {
  SimplifyOptions options;
  options.target_faces = target_faces;
  auto result = SimplifyMesh(mesh, options, RunContext());
  EXPECT_TRUE(result.ok()) << result.status();
  return result.ok() ? *std::move(result) : ControlMesh();
}

TEST(SimplifyMesh, SphereKeepsItsRadius) {
  const ControlMesh input = MarchTetrahedra(SphereField, 50);
  const ControlMesh result = SimplifiedTo(input, 1500);
  ExpectSameTopology(result, input);
  EXPECT_LE(result.faces.cols(), 1500);
  EXPECT_GE(result.faces.cols(), 1490);
  // Triangles of edge e on a sphere of radius r: the sagitta is e^2 / (6 r), here 0.0013 at the
  // mean edge of 0.056; the quadric balances it to both sides.
  EXPECT_LT(LargestField(result, SphereField), 0.003);
}

TEST(SimplifyMesh, ShapeIsRoundAndValencesModerate) {
  const ControlMesh result = SimplifiedTo(MarchTetrahedra(SphereField, 50), 1500);
  const std::vector<double> roundness = Roundnesses(result);
  EXPECT_GT(Mean(roundness), 0.85);
  int slivers = 0;
  for (const double r : roundness) slivers += r < 0.25 ? 1 : 0;
  EXPECT_EQ(slivers, 0);
  const std::vector<int> valences = Valences(result);
  EXPECT_LE(*std::max_element(valences.begin(), valences.end()), 10);
}

TEST(SimplifyMesh, TorusKeepsItsHandle) {
  const Field field = [](const Vector3d& x) { return TorusField(x); };
  const ControlMesh input = MarchTetrahedra(field, 40);
  for (const int target : {2000, 300, 60}) {
    const ControlMesh result = SimplifiedTo(input, target);
    ExpectSameTopology(result, input);
    EXPECT_LE(result.faces.cols(), target);
    if (target == 2000) {
      EXPECT_LT(LargestField(result, field), 0.004);
    }
  }
}

TEST(SimplifyMesh, GenusTwoStays) {
  const Field merged = [](const Vector3d& x) { return TwoToriField(x); };
  const ControlMesh input = MarchTetrahedra(merged, 48);
  ASSERT_EQ(Summary(input).genus, 2);
  ASSERT_EQ(Summary(input).components, 1);
  ExpectSameTopology(SimplifiedTo(input, 800), input);
}

TEST(SimplifyMesh, CylinderKeepsBothRims) {
  const ControlMesh input = OpenCylinder(120, 100);
  const ControlMesh result = SimplifiedTo(input, 600);
  ExpectSameTopology(result, input);
  EXPECT_LE(result.faces.cols(), 600);
  const auto topology = BuildMeshTopology(result.faces, static_cast<int>(result.vertices.cols()));
  ASSERT_TRUE(topology.ok());
  for (int v = 0; v < result.vertices.cols(); ++v) {
    const Vector3d x = result.vertices.col(v);
    EXPECT_NEAR(std::hypot(x.x(), x.y()), 0.2, 0.006);
    if (topology->boundary_vertex[v] != 0) {
      EXPECT_NEAR(std::abs(x.z()), 0.4, 0.004);
    }
  }
}

TEST(SimplifyMesh, EachComponentKeepsFaces) {
  const ControlMesh input = MarchTetrahedra(TwoSpheresField, 40);
  ASSERT_EQ(Summary(input).components, 2);
  const ControlMesh result = SimplifiedTo(input, 4);
  ExpectSameTopology(result, input);
  EXPECT_EQ(result.faces.cols(), 40);
}

TEST(SimplifyMesh, FlatPartsGetEvenFaces) {
  const ControlMesh input = Sheet(120, 100, false, [](double s, double t) -> Vector3d {
    return {s - 0.5, 0.8 * (t - 0.5), 0};
  });
  const ControlMesh result = SimplifiedTo(input, 800);
  ExpectSameTopology(result, input);
  const double mean_area = 0.8 / 800;
  for (const auto& face : result.faces.colwise()) {
    const Vector3d a = result.vertices.col(face[0]), b = result.vertices.col(face[1]),
                   c = result.vertices.col(face[2]);
    const Vector3d area = (b - a).cross(c - a) / 2;
    EXPECT_GT(area.z(), 0.1 * mean_area);
    EXPECT_LT(area.z(), 4 * mean_area);
    EXPECT_NEAR(a.z(), 0, 1e-9);
  }
  EXPECT_GT(Mean(Roundnesses(result)), 0.8);
  ControlMesh improved = result;
  ImproveValence(&improved, 40);
  RelaxTangentially(&improved, 3);
  EXPECT_GT(Mean(Roundnesses(improved)), 0.92);
}

TEST(SimplifyMesh, ScalesWithTheMesh) {
  ControlMesh input = MarchTetrahedra(SphereField, 30);
  const ControlMesh result = SimplifiedTo(input, 500);
  input.vertices *= 0.25;  // a power of two: the same bits but for exponents
  const ControlMesh small = SimplifiedTo(input, 500);
  ASSERT_EQ(small.faces, result.faces);
  EXPECT_TRUE(small.vertices.isApprox(0.25 * result.vertices, 1e-12));
}

TEST(SimplifyMesh, IsDeterministicForAnyThreadCount) {
  const ControlMesh input = MarchTetrahedra(SphereField, 60);
  ASSERT_GT(input.vertices.cols(), 20000) << "enough for blocks";
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  for (const double unordered_until : {8.0, 1.0}) {
    const SimplifyOptions options{.unordered_until = unordered_until};
    const auto a = SimplifyMesh(input, options, one);
    const auto b = SimplifyMesh(input, options, two);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->faces.cols(), options.target_faces);
    EXPECT_EQ(a->faces, b->faces);
    EXPECT_EQ(a->vertices, b->vertices);
  }
}

TEST(SimplifyMesh, LeavesASmallMeshAlone) {
  const ControlMesh input = OpenCylinder(12, 5);
  const ControlMesh result = SimplifiedTo(input, 1000);
  EXPECT_EQ(result.faces, input.faces);
  EXPECT_EQ(result.vertices, input.vertices);
}

TEST(SimplifyMesh, Refuses) {
  ControlMesh mesh = OpenCylinder(12, 5);
  SimplifyOptions options;
  EXPECT_EQ(SimplifyMesh(mesh, options, Stopped()).status().code(), absl::StatusCode::kCancelled);
  mesh.vertices(1, 3) = std::nan("");
  EXPECT_EQ(SimplifyMesh(mesh, options, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
  mesh = OpenCylinder(12, 5);
  mesh.faces.col(1) = mesh.faces.col(0);
  EXPECT_EQ(SimplifyMesh(mesh, options, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
