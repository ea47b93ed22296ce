// The evaluator against OpenSubdiv's Bfr, which isolates irregular vertices ten levels deep and
// approximates what is left around them.
#include <gtest/gtest.h>
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/evaluate/limit_evaluator.h"
#include "core/loop/crease_topology.h"
#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

namespace Bfr = OpenSubdiv::OPENSUBDIV_VERSION::Bfr;
namespace Far = OpenSubdiv::OPENSUBDIV_VERSION::Far;
namespace Sdc = OpenSubdiv::OPENSUBDIV_VERSION::Sdc;

constexpr int kIsolation = 10;

std::unique_ptr<Far::TopologyRefiner> Refiner(const ControlMesh& mesh) {
  const std::vector<int> corners_per_face(static_cast<size_t>(mesh.faces.cols()), 3);
  std::vector<int> ends;
  std::vector<float> sharpness;
  for (const Crease& crease : mesh.creases) {
    ends.insert(ends.end(), {crease.a, crease.b});
    sharpness.push_back(crease.sharpness);
  }
  const std::vector<float> corner_sharpness(mesh.corners.size(), kInfiniteSharpness);
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(mesh.vertices.cols());
  descriptor.numFaces = static_cast<int>(mesh.faces.cols());
  descriptor.numVertsPerFace = corners_per_face.data();
  descriptor.vertIndicesPerFace = mesh.faces.data();
  descriptor.numCreases = static_cast<int>(sharpness.size());
  descriptor.creaseVertexIndexPairs = ends.data();
  descriptor.creaseWeights = sharpness.data();
  descriptor.numCorners = static_cast<int>(mesh.corners.size());
  descriptor.cornerVertexIndices = mesh.corners.data();
  descriptor.cornerWeights = corner_sharpness.data();
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  return std::unique_ptr<Far::TopologyRefiner>(
      Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_LOOP, options)));
}

class BfrOracleTest : public ::testing::TestWithParam<testing::NamedMesh> {};

TEST_P(BfrOracleTest, EqualsBfrAwayFromTheVertices) {
  const ControlMesh& mesh = GetParam().mesh;
  const auto evaluator = LimitEvaluator::Build(mesh, RunContext());
  ASSERT_TRUE(evaluator.ok()) << evaluator.status();
  const std::unique_ptr<Far::TopologyRefiner> refiner = Refiner(mesh);
  Bfr::SurfaceFactory::Options options;
  options.SetApproxLevelSmooth(kIsolation);
  options.SetApproxLevelSharp(kIsolation);
  const Bfr::RefinerSurfaceFactory<> factory(*refiner, options);
  const double diagonal =
      (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
  testing::Random random(5);
  double worst = 0, worst_first = 0, worst_second = 0;
  for (int f = 0; f < evaluator->face_count(); ++f) {
    const std::unique_ptr<Bfr::Surface<double>> surface(factory.CreateVertexSurface<double>(f));
    ASSERT_NE(surface, nullptr);
    std::vector<double> points(static_cast<size_t>(surface->GetNumPatchPoints()) * 3);
    surface->PreparePatchPoints(mesh.vertices.data(), {3, 3}, points.data(), {3, 3});
    for (int i = 0; i < 50; ++i) {
      // Near the corners, but not where Bfr is approximate.
      const double step = std::ldexp(1.0, -random.Below(9));
      double u = step * (random.Signed() + 1) / 2, v = step - u;
      for (int turn = random.Below(3); turn > 0; --turn) {
        const double w = 1 - u - v;
        u = v;
        v = w;
      }
      if (std::max({u, v, 1 - u - v}) > 1 - std::ldexp(1.0, -kIsolation)) continue;
      const double at[2] = {u, v};
      double position[3], du[3], dv[3], duu[3], duv[3], dvv[3];
      surface->Evaluate(at, points.data(), {3, 3}, position, du, dv, duu, duv, dvv);
      const SurfaceJet jet = evaluator->At(f, u, v, JetOrder::kSecond);
      for (int k = 0; k < 3; ++k) {
        worst = std::max(worst, std::abs(jet.position[k] - position[k]));
        worst_first =
            std::max({worst_first, std::abs(jet.u[k] - du[k]), std::abs(jet.v[k] - dv[k])});
      }
      // OpenSubdiv 3.5 negates the second derivatives of middle children, whose parameters run
      // backwards.
      const auto second = [&](double sign) {
        double most = 0;
        for (int k = 0; k < 3; ++k) {
          most =
              std::max({most, std::abs(jet.uu[k] - sign * duu[k]),
                        std::abs(jet.uv[k] - sign * duv[k]), std::abs(jet.vv[k] - sign * dvv[k])});
        }
        return most;
      };
      worst_second = std::max(worst_second, std::min(second(1), second(-1)));
    }
  }
  EXPECT_LT(worst, 1e-13 * diagonal);
  EXPECT_LT(worst_first, 1e-11 * diagonal);
  EXPECT_LT(worst_second, 1e-8 * diagonal);
}

std::vector<testing::NamedMesh> Meshes() {
  std::vector<testing::NamedMesh> meshes = testing::LoopMeshes();
  for (testing::NamedMesh& mesh : testing::CreaseMeshes()) meshes.push_back(std::move(mesh));
  return meshes;
}

INSTANTIATE_TEST_SUITE_P(Meshes, BfrOracleTest, ::testing::ValuesIn(Meshes()),
                         [](const auto& at) { return at.param.name; });

}  // namespace
}  // namespace rilievo
