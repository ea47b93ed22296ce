#include "core/evaluate/limit_evaluator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/evaluate/surface_jet.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"
#include "core/loop/split_normals.h"
#include "tests/unit/loop/quad_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

LimitEvaluator Evaluator(const ControlMesh& mesh) {
  auto evaluator = LimitEvaluator::Build(mesh, RunContext());
  EXPECT_TRUE(evaluator.ok()) << evaluator.status();
  return *std::move(evaluator);
}

double DiagonalOf(const ControlMesh& mesh) {
  return (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
}

// A point at a dyadic parameter with its limit by uniform refinement.
struct DyadicPoint {
  int face, vertex;  // vertex of the level
  double u, v;
};

std::vector<DyadicPoint> DyadicPoints(const LoopRefinement& refinement, int level) {
  const FaceSamples samples = SamplesOfControlFaces(refinement, level);
  const int n = 1 << level;
  std::vector<DyadicPoint> points;
  for (int f = 0; f < refinement.levels[0].face_count(); ++f) {
    int place = f * samples.per_face;
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i + j <= n; ++i) {
        points.push_back({f, samples.vertices[place++], double(i) / n, double(j) / n});
      }
    }
  }
  return points;
}

std::vector<testing::NamedMesh> AllMeshes() {
  std::vector<testing::NamedMesh> meshes = testing::LoopMeshes();
  for (testing::NamedMesh& mesh : testing::CreaseMeshes()) meshes.push_back(std::move(mesh));
  return meshes;
}

std::vector<testing::NamedMesh> SmallQuadMeshes() {
  std::vector<testing::NamedMesh> meshes;
  for (testing::NamedMesh& mesh : testing::QuadMeshes()) {
    if (mesh.mesh.faces.cols() <= 500) meshes.push_back({"Quads" + mesh.name, mesh.mesh});
  }
  return meshes;
}

class LimitEvaluatorTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(LimitEvaluatorTest, EqualsUniformRefinementAtDyadicParameters) {
  constexpr int kLevel = 5;
  const LimitEvaluator evaluator = Evaluator(mesh());
  const auto refinement = RefineTopology(mesh(), kLevel, RunContext());
  ASSERT_TRUE(refinement.ok()) << refinement.status();
  const auto limit = EvaluateLimit(*refinement, mesh().vertices, kLevel, RunContext());
  ASSERT_TRUE(limit.ok()) << limit.status();
  const auto sectors = SectorsOfLevel(*refinement, kLevel);
  ASSERT_TRUE(sectors.ok()) << sectors.status();
  std::vector<uint8_t> several_sides(limit->positions.cols(), 0);
  for (int v : sectors->vertices) several_sides[v] = 1;
  double worst = 0, worst_normal = 0;
  for (const DyadicPoint& at : DyadicPoints(*refinement, kLevel)) {
    const SurfaceJet jet = evaluator.At(at.face, at.u, at.v, JetOrder::kFirst);
    worst = std::max(worst, (jet.position - limit->positions.col(at.vertex)).norm());
    if (several_sides[at.vertex] == 0) {
      worst_normal = std::max(worst_normal, (NormalOf(jet) - limit->normals.col(at.vertex)).norm());
    }
  }
  EXPECT_LT(worst, 1e-13 * DiagonalOf(mesh()));
  EXPECT_LT(worst_normal, 1e-9);
}

TEST_P(LimitEvaluatorTest, NormalsOfSidesAreThoseOfTheFacesOwnSide) {
  constexpr int kLevel = 2;
  const LimitEvaluator evaluator = Evaluator(mesh());
  const auto refinement = RefineTopology(mesh(), kLevel, RunContext());
  ASSERT_TRUE(refinement.ok()) << refinement.status();
  const auto limit = EvaluateLimit(*refinement, mesh().vertices, kLevel, RunContext());
  ASSERT_TRUE(limit.ok()) << limit.status();
  const auto sectors = SectorsOfLevel(*refinement, kLevel);
  ASSERT_TRUE(sectors.ok()) << sectors.status();
  for (int s = 0; s < sectors->size(); ++s) {
    for (int i = sectors->begin[s]; i < sectors->begin[s + 1]; ++i) {
      const uint32_t half_edge = sectors->half_edges[i];
      double u = half_edge % 3 == 1, v = half_edge % 3 == 2;
      int face = static_cast<int>(half_edge / 3);
      for (int level = 0; level < kLevel; ++level, face /= 4) {
        const int child = face % 4;
        u = child == 3 ? (1 - u) / 2 : (u + (child == 1)) / 2;
        v = child == 3 ? (1 - v) / 2 : (v + (child == 2)) / 2;
      }
      const SurfaceJet jet = evaluator.At(face, u, v, JetOrder::kFirst);
      EXPECT_LT((NormalOf(jet) - limit->sector_normals.col(s)).norm(), 1e-9)
          << "face " << face << " at " << u << ", " << v;
    }
  }
}

// Derivatives are those of the positions: central differences in the middle of pieces.
TEST_P(LimitEvaluatorTest, DerivativesAreSlopes) {
  const LimitEvaluator evaluator = Evaluator(mesh());
  constexpr double kStep = 1e-4;
  const double most = DiagonalOf(mesh());
  for (int f = 0; f < evaluator.face_count(); ++f) {
    for (const auto& [u, v] : {std::pair(0.3, 0.31), {0.07, 0.06}, {0.9, 0.04}, {0.01, 0.981}}) {
      const SurfaceJet jet = evaluator.At(f, u, v, JetOrder::kSecond);
      const auto at = [&](int i, int j) {
        return evaluator.At(f, u + i * kStep, v + j * kStep, JetOrder::kFirst);
      };
      const double twice = 2 * kStep;
      EXPECT_LT((jet.u - (at(1, 0).position - at(-1, 0).position) / twice).norm(), 1e-4 * most);
      EXPECT_LT((jet.v - (at(0, 1).position - at(0, -1).position) / twice).norm(), 1e-4 * most);
      EXPECT_LT((jet.uu - (at(1, 0).u - at(-1, 0).u) / twice).norm(), 1e-2 * most);
      EXPECT_LT((jet.uv - (at(0, 1).u - at(0, -1).u) / twice).norm(), 1e-2 * most);
      EXPECT_LT((jet.vv - (at(0, 1).v - at(0, -1).v) / twice).norm(), 1e-2 * most);
    }
  }
}

// However near to an irregular vertex.
TEST_P(LimitEvaluatorTest, TendsToTheVertex) {
  const LimitEvaluator evaluator = Evaluator(mesh());
  for (int f = 0; f < evaluator.face_count(); ++f) {
    const SurfaceJet vertex = evaluator.At(f, 0, 0, JetOrder::kFirst);
    for (int power : {20, 40, 60}) {
      const double step = std::ldexp(1.0, -power);
      const SurfaceJet jet = evaluator.At(f, 0.4 * step, 0.3 * step, JetOrder::kFirst);
      // The rings of valence 50 shrink by 0.62 a level.
      EXPECT_LT((jet.position - vertex.position).norm(), 10 * std::pow(0.63, power));
      EXPECT_TRUE(jet.u.allFinite() && jet.v.allFinite());
      // In a corner of one face the tangents become parallel: the sine halves from level to level.
      if (power > 20) continue;
      EXPECT_NEAR(NormalOf(jet).norm(), 1, 1e-12) << "face " << f << " at 2^-" << power;
    }
  }
}

TEST(LimitEvaluatorOfSmoothMeshTest, NormalsTendToThoseOfTheVertex) {
  for (const testing::NamedMesh& named : testing::LoopMeshes()) {
    const auto topology =
        BuildMeshTopology(named.mesh.faces, static_cast<int>(named.mesh.vertices.cols()));
    ASSERT_TRUE(topology.ok()) << topology.status();
    const LimitEvaluator evaluator = Evaluator(named.mesh);
    for (int f = 0; f < evaluator.face_count(); ++f) {
      // At valence 50 what is left of other directions shrinks by 2 % a level only.
      if (topology->valence[topology->faces(0, f)] > 12) continue;
      if (topology->boundary_vertex[topology->faces(0, f)] != 0) continue;
      const Vector3d normal = NormalOf(evaluator.At(f, 0, 0, JetOrder::kFirst));
      const double near = std::ldexp(1.0, -120);
      const SurfaceJet jet = evaluator.At(f, 0.4 * near, 0.3 * near, JetOrder::kFirst);
      EXPECT_LT((NormalOf(jet) - normal).norm(), 1e-6) << named.name << " face " << f;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, LimitEvaluatorTest, ::testing::ValuesIn(AllMeshes()),
                         [](const auto& at) { return at.param.name; });
INSTANTIATE_TEST_SUITE_P(QuadMeshes, LimitEvaluatorTest, ::testing::ValuesIn(SmallQuadMeshes()),
                         [](const auto& at) { return at.param.name; });

// Control points on a paraboloid over a regular lattice: the surface is that paraboloid, lifted.
TEST(LimitEvaluatorOfParaboloidTest, HasItsCurvatures) {
  ControlMesh mesh = testing::Grid(9, 9);
  const double a = 0.7, b = -0.3;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i) {
    const Vector3d at = mesh.vertices.col(i) - Vector3d(0.5, 0.5, 0);
    mesh.vertices(2, i) = -(a * at.x() * at.x() + b * at.y() * at.y()) / 2;
  }
  const LimitEvaluator evaluator = Evaluator(mesh);
  int met = 0;
  for (int f = 0; f < evaluator.face_count(); ++f) {
    for (const auto& [u, v] : {std::pair(0.0, 0.0), {1.0, 0.0}, {0.0, 1.0}}) {
      const SurfaceJet jet = evaluator.At(f, u, v, JetOrder::kSecond);
      if ((jet.position - Vector3d(0.5, 0.5, jet.position.z())).norm() > 1e-9) continue;
      ++met;
      const SurfaceShape shape = ShapeOf(jet);
      EXPECT_LT((shape.normal - Vector3d::UnitZ()).norm(), 1e-12);
      EXPECT_NEAR(shape.greatest_curvature, a, 1e-11);
      EXPECT_NEAR(shape.least_curvature, b, 1e-11);
    }
  }
  EXPECT_EQ(met, 6);
}

TEST(LimitEvaluatorRefusalTest, NamesWhatIsOutOfRange) {
  const LimitEvaluator evaluator = Evaluator(testing::Icosahedron());
  EXPECT_TRUE(evaluator.Check(19, 1, 0).ok());
  for (const auto& [face, u, v, said] :
       {std::tuple(20, 0.1, 0.1, "face is 20, this surface has control faces 0 to 19"),
        {-1, 0.1, 0.1, "face is -1"},
        {0, 0.6, 0.5, "u is 0.6 and v is 0.5"},
        {0, -0.1, 0.5, "u is -0.1"},
        {0, std::nan(""), 0.5, "u is nan"}}) {
    const absl::Status status = evaluator.Check(face, u, v);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr(said));
  }
}

// Semi-sharp edges that are sharp for nine levels cut faces that often.
TEST(LimitEvaluatorRefusalTest, RefusesMoreSemiSharpEdgesThanFit) {
  testing::Random random(3);
  const ControlMesh mesh =
      testing::WithRandomCreases(testing::Torus(40, 40), 1.0, {9.5f}, 0, random);
  const auto evaluator = LimitEvaluator::Build(mesh, RunContext());
  EXPECT_EQ(evaluator.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(evaluator.status().message()), ::testing::HasSubstr("semi-sharp"));
}

}  // namespace
}  // namespace rilievo
