#include "core/evaluate/displaced_evaluator.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/loop/limit_stencils.h"
#include "tests/unit/evaluate/relief_surfaces.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

DisplacedEvaluator Evaluator(const DisplacedSurface& surface) {
  auto evaluator = DisplacedEvaluator::Build(surface, RunContext());
  EXPECT_TRUE(evaluator.ok()) << evaluator.status();
  return *std::move(evaluator);
}

TEST(DisplacedEvaluatorTest, PassesThroughTheVertices) {
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    const DisplacedEvaluator evaluator = Evaluator(surface);
    const auto mesh = Tessellate(surface, surface.max_level, RunContext());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    const auto refinement = RefineTopology(surface.control_mesh, surface.max_level, RunContext());
    ASSERT_TRUE(refinement.ok()) << refinement.status();
    const FaceSamples samples = SamplesOfControlFaces(*refinement, surface.max_level);
    const int n = 1 << surface.max_level;
    for (int f = 0; f < evaluator.face_count(); ++f) {
      int place = f * samples.per_face;
      for (int j = 0; j <= n; ++j) {
        for (int i = 0; i + j <= n; ++i) {
          const Vector3d vertex = mesh->vertices.col(samples.vertices[place++]);
          const SurfaceJet jet = evaluator.At(f, double(i) / n, double(j) / n, JetOrder::kPosition);
          EXPECT_LT((jet.position - vertex).norm(), 1e-13 * surface.frame.diagonal + 1e-14)
              << name << " face " << f << " at " << i << ", " << j;
        }
      }
    }
  }
}

// Edges of control faces, creased or not, are the same curve from both sides.
TEST(DisplacedEvaluatorTest, IsContinuousAcrossFaces) {
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    const DisplacedEvaluator evaluator = Evaluator(surface);
    const auto topology = BuildMeshTopology(surface.control_mesh.faces,
                                            static_cast<int>(surface.control_mesh.vertices.cols()));
    ASSERT_TRUE(topology.ok()) << topology.status();
    const auto on_edge = [&](int face, int side, double share) {
      double weights[3] = {0, 0, 0};
      weights[side] = 1 - share;
      weights[(side + 1) % 3] = share;
      return evaluator.At(face, weights[1], weights[2], JetOrder::kPosition).position;
    };
    for (int f = 0; f < evaluator.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int across = topology->face_neighbors(k, f);
        if (across < 0) continue;
        int side = 0;
        while (topology->face_edges(side, across) != topology->face_edges(k, f)) ++side;
        for (const double share : {0.013, 0.37, 0.5, 0.81}) {
          EXPECT_LT((on_edge(f, k, share) - on_edge(across, side, 1 - share)).norm(), 1e-12)
              << name << " face " << f << " side " << k << " at " << share;
        }
      }
    }
  }
}

TEST(DisplacedEvaluatorTest, DerivativesAreSlopes) {
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    const DisplacedEvaluator evaluator = Evaluator(surface);
    constexpr double kStep = 1e-5;
    for (int f = 0; f < evaluator.face_count(); ++f) {
      for (const auto& [u, v] : {std::pair(0.28, 0.31), {0.7, 0.1}, {0.1, 0.1}, {0.1, 0.86}}) {
        const SurfaceJet jet = evaluator.At(f, u, v, JetOrder::kSecond);
        const SurfaceJet after_u = evaluator.At(f, u + kStep, v, JetOrder::kFirst),
                         before_u = evaluator.At(f, u - kStep, v, JetOrder::kFirst),
                         after_v = evaluator.At(f, u, v + kStep, JetOrder::kFirst),
                         before_v = evaluator.At(f, u, v - kStep, JetOrder::kFirst);
        const double scale = surface.frame.diagonal, twice = 2 * kStep;
        EXPECT_LT((jet.u - (after_u.position - before_u.position) / twice).norm(), 1e-6 * scale);
        EXPECT_LT((jet.v - (after_v.position - before_v.position) / twice).norm(), 1e-6 * scale);
        EXPECT_LT((jet.uu - (after_u.u - before_u.u) / twice).norm(), 1e-3 * scale) << name;
        EXPECT_LT((jet.uv - (after_v.u - before_v.u) / twice).norm(), 1e-3 * scale) << name;
        EXPECT_LT((jet.vv - (after_v.v - before_v.v) / twice).norm(), 1e-3 * scale) << name;
      }
    }
  }
}

// At an irregular vertex the surface has the flat triangle's normal, for its own is that of a cusp.
TEST(DisplacedEvaluatorTest, HasTheFlatTrianglesNormalAtIrregularVertices) {
  const DisplacedSurface surface = testing::WithRelief(testing::Icosahedron(), 3, 0.02);
  const DisplacedEvaluator evaluator = Evaluator(surface);
  const auto point = [&](double u, double v) {
    return evaluator.At(0, u, v, JetOrder::kPosition).position;
  };
  for (const auto& [u, v] : {std::pair(0.0, 0.0), {1.0, 0.0}, {0.0, 1.0}}) {
    const SurfaceJet jet = evaluator.At(0, u, v, JetOrder::kSecond);
    EXPECT_TRUE(jet.irregular);
    const double i = std::min(u, 7.0 / 8), j = std::min(v, 7.0 / 8);
    const Vector3d normal = (point(i + 1.0 / 8, j) - point(i, j))
                                .cross(point(i, j + 1.0 / 8) - point(i, j))
                                .normalized();
    EXPECT_LT((NormalOf(jet) - normal).norm(), 1e-12);
    EXPECT_TRUE(std::isnan(ShapeOf(jet).least_curvature));
  }
}

TEST(DisplacedEvaluatorTest, WithoutHeightsIsTheLimitSurface) {
  const DisplacedSurface surface = testing::WithRelief(testing::Torus(8, 6), 2, 0);
  const DisplacedEvaluator evaluator = Evaluator(surface);
  for (int f = 0; f < evaluator.face_count(); ++f) {
    const SurfaceJet jet = evaluator.At(f, 0.3, 0.4, JetOrder::kSecond);
    const SurfaceJet limit = evaluator.LimitAt(f, 0.3, 0.4, JetOrder::kSecond);
    EXPECT_EQ(jet.position, limit.position);
    EXPECT_EQ(jet.u, limit.u);
    EXPECT_EQ(jet.vv, limit.vv);
  }
}

// Fewer places than are looked ahead, as many, and more; irregular vertices among them.
TEST(DisplacedEvaluatorTest, ManyPlacesAreTheSameAsOneByOne) {
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    const DisplacedEvaluator evaluator = Evaluator(surface);
    testing::Random random(31);
    std::vector<DisplacedEvaluator::Parameter> places = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    while (places.size() < 100) {
      const double u = (random.Signed() + 1) / 2;
      places.push_back({random.Below(evaluator.face_count()), u, (1 - u) / 3});
    }
    for (const size_t count : {0, 1, 3, 4, 5, 100}) {
      for (const JetOrder order : {JetOrder::kPosition, JetOrder::kSecond}) {
        std::vector<SurfaceJet> jets(count);
        evaluator.AtAll({places.data(), count}, order, jets.data());
        for (size_t i = 0; i < count; ++i) {
          const SurfaceJet jet = evaluator.At(places[i].face, places[i].u, places[i].v, order);
          EXPECT_EQ(jets[i].position, jet.position) << name << " place " << i << " of " << count;
          EXPECT_EQ(jets[i].irregular, jet.irregular);
          if (order == JetOrder::kPosition) continue;
          EXPECT_EQ(jets[i].u, jet.u);
          EXPECT_EQ(jets[i].v, jet.v);
          if (jet.irregular) continue;
          EXPECT_EQ(jets[i].vv, jet.vv);
        }
      }
    }
  }
}

TEST(DisplacedEvaluatorTest, RefusesHeightsThatDoNotFit) {
  DisplacedSurface surface = testing::WithRelief(testing::Torus(8, 6), 2, 0);
  surface.heights.pop_back();
  surface.sources.pop_back();
  EXPECT_EQ(DisplacedEvaluator::Build(surface, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
