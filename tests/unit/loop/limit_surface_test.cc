#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/loop/loop_masks.h"
#include "core/loop/refinement.h"
#include "tests/unit/geometry/test_meshes.h"
#include "tests/unit/loop/loop_meshes.h"
#include "tests/unit/loop/opensubdiv_oracle.h"

namespace rilievo {
namespace {

using testing::Refine;

constexpr int kLevel = 3;

LimitSurface Evaluate(const LoopRefinement& refinement, const Eigen::Matrix3Xd& control_points,
                      int level, int threads = 1) {
  RunContext context;
  context.threads = threads;
  auto limit = EvaluateLimit(refinement, control_points, level, context);
  EXPECT_TRUE(limit.ok()) << limit.status();
  return *std::move(limit);
}

double LargestDifference(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

class LimitSurfaceTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(LimitSurfaceTest, AgreesWithOpenSubdivOnEveryLevel) {
  const LoopRefinement refinement = Refine(mesh(), kLevel);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  for (int level = 0; level <= kLevel; ++level) {
    const LimitSurface limit = Evaluate(refinement, mesh().vertices, level);
    const MeshTopology& topology = refinement.levels[level];
    ASSERT_EQ(limit.positions.cols(), topology.vertex_count);
    ASSERT_EQ(limit.normals.cols(), topology.vertex_count);
    EXPECT_LT(LargestDifference(limit.positions, oracle[level].limit_positions), 1e-13) << level;
    for (int v = 0; v < topology.vertex_count; ++v) {
      // At irregular boundary vertices OpenSubdiv uses the tangent of another edge rule, see
      // loop_masks.h; IrregularBoundaryNormalsAreThoseOfTheSurface covers them.
      if (topology.boundary_vertex[v] && topology.valence[v] > 4) continue;
      EXPECT_LT((limit.normals.col(v) - oracle[level].limit_normals.col(v)).norm(), 1e-9)
          << "level " << level << " vertex " << v << " valence " << topology.valence[v];
    }
  }
}

TEST_P(LimitSurfaceTest, AVertexHasOneLimit) {
  const LoopRefinement refinement = Refine(mesh(), kLevel);
  const LimitSurface fine = Evaluate(refinement, mesh().vertices, kLevel);
  for (int level = 0; level < kLevel; ++level) {
    const LimitSurface coarse = Evaluate(refinement, mesh().vertices, level);
    EXPECT_EQ(coarse.positions, fine.positions.leftCols(coarse.positions.cols()));
    EXPECT_EQ(coarse.normals, fine.normals.leftCols(coarse.normals.cols()));
  }
  // The mask at a later level gives the same point.
  Eigen::Matrix3Xd subdivided = mesh().vertices;
  for (int level = 0; level < 2; ++level) {
    subdivided = SubdivideOnce(refinement, level, subdivided);
  }
  const LoopRefinement from_level_2 = Refine({subdivided, refinement.levels[2].faces}, 0);
  const LimitSurface limit = Evaluate(from_level_2, subdivided, 0);
  EXPECT_LT(LargestDifference(limit.positions, fine.positions.leftCols(limit.positions.cols())),
            1e-13);
  EXPECT_LT(LargestDifference(limit.normals, fine.normals.leftCols(limit.normals.cols())), 1e-9);
}

TEST_P(LimitSurfaceTest, NeedsNoTopologyOfItsOwnLevel) {
  const LimitSurface full = Evaluate(Refine(mesh(), kLevel), mesh().vertices, kLevel);
  const LimitSurface lean = Evaluate(Refine(mesh(), kLevel - 1), mesh().vertices, kLevel);
  EXPECT_EQ(lean.positions, full.positions);
  EXPECT_EQ(lean.normals, full.normals);
}

TEST_P(LimitSurfaceTest, TurnsAndScalesWithTheControlPoints) {
  testing::Random random(7);
  const LoopRefinement refinement = Refine(mesh(), 2);
  const LimitSurface limit = Evaluate(refinement, mesh().vertices, 2);
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(1.1, random.Vector().normalized()).toRotationMatrix();
  const Eigen::Vector3d offset = random.Vector();
  const Eigen::Matrix3Xd moved = (rotation * (0.3 * mesh().vertices)).colwise() + offset;
  const LimitSurface moved_limit = Evaluate(refinement, moved, 2);
  const Eigen::Matrix3Xd expected = (rotation * (0.3 * limit.positions)).colwise() + offset;
  EXPECT_LT(LargestDifference(moved_limit.positions, expected), 1e-14);
  EXPECT_LT(LargestDifference(moved_limit.normals, rotation * limit.normals), 1e-9);
}

TEST_P(LimitSurfaceTest, NormalsAreUnitAndSameForAnyThreadCount) {
  const LoopRefinement refinement = Refine(mesh(), kLevel);
  const LimitSurface one = Evaluate(refinement, mesh().vertices, kLevel, 1);
  const LimitSurface two = Evaluate(refinement, mesh().vertices, kLevel, 2);
  EXPECT_EQ(one.positions, two.positions);
  EXPECT_EQ(one.normals, two.normals);
  EXPECT_LT((one.normals.colwise().norm().array() - 1.0).abs().maxCoeff(), 1e-14);
}

INSTANTIATE_TEST_SUITE_P(Meshes, LimitSurfaceTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

// The normal of a vertex' faces after many steps of subdivision of its neighbourhood: slow, but
// free of any tangent mask. Subdivides only the ring: it determines itself.
Eigen::Vector3d NormalAfterManySteps(Eigen::Matrix3Xd ring, int steps) {
  const Eigen::Index last = ring.cols() - 1;  // column 0: the vertex, then p_0 .. p_k
  for (int step = 0; step < steps; ++step) {
    Eigen::Matrix3Xd next = ring;
    next.col(0) = 0.75 * ring.col(0) + 0.125 * (ring.col(1) + ring.col(last));
    for (Eigen::Index i = 1; i <= last; ++i) {
      next.col(i) = i == 1 || i == last
                        ? Eigen::Vector3d(0.5 * (ring.col(0) + ring.col(i)))
                        : Eigen::Vector3d(0.375 * (ring.col(0) + ring.col(i)) +
                                          0.125 * (ring.col(i - 1) + ring.col(i + 1)));
    }
    // Kept about the vertex and at one size, lest the differences drown.
    const Eigen::Vector3d center = next.col(0);
    next.colwise() -= center;
    ring = next / next.cwiseAbs().maxCoeff();
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 1; i < last; ++i) sum += ring.col(i).cross(ring.col(i + 1)).normalized();
  return sum.normalized();
}

TEST(LimitSurfaceBoundaryTest, IrregularBoundaryNormalsAreThoseOfTheSurface) {
  testing::Random random(8);
  // Steps until the slowest mode that is not a tangent has died against the faster of the two that
  // are: with five faces (3/8 + cos(72 deg)/4) / (1/2) = 0.90 a step. Few where that tangent itself
  // dies against the other.
  const std::array<int, 5> steps = {20, 50, 50, 60, 150};
  for (int faces = 1; faces <= 5; ++faces) {
    const ControlMesh mesh = testing::Perturbed(testing::HalfFan(faces), 0.3, random);
    const LoopRefinement refinement = Refine(mesh, 0);
    ASSERT_EQ(refinement.levels[0].valence[0], faces + 1);
    const LimitSurface limit = Evaluate(refinement, mesh.vertices, 0);
    const Eigen::Vector3d expected = NormalAfterManySteps(mesh.vertices, steps[faces - 1]);
    EXPECT_LT((limit.normals.col(0) - expected).norm(), 1e-6) << faces << " faces";
  }
}

TEST(LimitSurfaceValueTest, IcosahedronIsASphereByItsSymmetry) {
  const ControlMesh mesh = testing::Icosahedron();
  const LimitSurface limit = Evaluate(Refine(mesh, 0), mesh.vertices, 0);
  // The ring of a vertex of the unit icosahedron lies at the height 1/sqrt(5).
  const double ring_weight = 5.0 * LoopLimitWeight(5);
  const double radius = 1.0 - ring_weight + ring_weight / std::sqrt(5.0);
  EXPECT_LT(LargestDifference(limit.positions, radius * mesh.vertices), 1e-15);
  EXPECT_LT(LargestDifference(limit.normals, mesh.vertices), 1e-14);
}

TEST(LimitSurfaceValueTest, RegularGridReproducesQuadratics) {
  // The box spline of valence 6 on the samples of x^2, grid step h: four of the six neighbours lie
  // h aside, so the limit is x^2 + 4/12 h^2 everywhere, and the gradient exactly (2x, 0).
  ControlMesh mesh = testing::Grid(9, 9);
  for (int v = 0; v < 81; ++v) mesh.vertices(2, v) = mesh.vertices(0, v) * mesh.vertices(0, v);
  const LoopRefinement refinement = Refine(mesh, 2);
  const LimitSurface limit = Evaluate(refinement, mesh.vertices, 2);
  const double h = 1.0 / 8.0;
  int checked = 0;
  for (int v = 0; v < limit.positions.cols(); ++v) {
    const double x = limit.positions(0, v), y = limit.positions(1, v);
    if (std::min({x, y, 1 - x, 1 - y}) < 2 * h) continue;  // the boundary rule reaches two faces in
    EXPECT_NEAR(limit.positions(2, v), x * x + h * h / 3.0, 1e-14);
    const Eigen::Vector3d normal = Eigen::Vector3d(-2.0 * x, 0, 1).normalized();
    EXPECT_LT((limit.normals.col(v) - normal).norm(), 1e-12);
    ++checked;
  }
  EXPECT_GT(checked, 200);
}

TEST(LimitSurfaceDegenerateTest, NormalsAreNeverNan) {
  const ControlMesh mesh = testing::Icosahedron();
  const LoopRefinement refinement = Refine(mesh, 2);
  // All points alike, all on a line, and all zero.
  Eigen::Matrix3Xd line = Eigen::Matrix3Xd::Zero(3, 12);
  line.row(0) = mesh.vertices.row(2);
  for (const Eigen::Matrix3Xd& points : {Eigen::Matrix3Xd(Eigen::Matrix3Xd::Constant(3, 12, 0.3)),
                                         line, Eigen::Matrix3Xd(Eigen::Matrix3Xd::Zero(3, 12))}) {
    const LimitSurface limit = Evaluate(refinement, points, 2);
    EXPECT_TRUE(limit.positions.allFinite());
    EXPECT_LT((limit.normals.colwise().norm().array() - 1.0).abs().maxCoeff(), 1e-14);
  }
}

TEST(LimitSurfaceDegenerateTest, FallsBackToTheFacesAround) {
  // Tangents of a double cone over a six-pointed flower: the ring of the apex is chosen so that
  // sum cos(a_i) p_i and sum sin(a_i) p_i vanish, though the faces all look upward.
  ControlMesh mesh = testing::Bipyramid(6);
  for (int i = 0; i < 6; ++i) {
    const double angle = i % 3 * 2.0 * std::numbers::pi / 3.0;  // turns twice: second harmonic
    mesh.vertices.col(2 + i) << std::cos(angle), std::sin(angle), 0;
  }
  const LimitSurface limit = Evaluate(Refine(mesh, 0), mesh.vertices, 0);
  EXPECT_LT((limit.normals.col(0) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(EvaluateLimitTest, RefusesWrongArguments) {
  const ControlMesh mesh = testing::Icosahedron();
  const LoopRefinement refinement = Refine(mesh, 1);
  for (const int level : {-1, 3}) {
    EXPECT_EQ(EvaluateLimit(refinement, mesh.vertices, level, RunContext()).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(EvaluateLimit(refinement, mesh.vertices.leftCols(11), 1, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(EvaluateLimitTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const ControlMesh mesh = testing::Icosahedron();
  EXPECT_EQ(EvaluateLimit(Refine(mesh, 1), mesh.vertices, 1, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
