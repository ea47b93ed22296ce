// Exact evaluation at random parameters, and OpenSubdiv's Bfr beside it. Items are evaluations.
#include <benchmark/benchmark.h>
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/evaluate/closest_point_finder.h"
#include "core/evaluate/limit_evaluator.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/face_vertices.h"
#include "core/surface/displaced_surface.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

// A bumpy torus of 4 800 faces, five of six with an irregular vertex.
ControlMesh BumpyTorus() {
  testing::Random random(7);
  return testing::Perturbed(testing::SplitRandomFaces(testing::Torus(40, 40), 800, random), 0.01,
                            random);
}

struct Parameter {
  int face;
  double u, v;
};

std::vector<Parameter> RandomParameters(int face_count) {
  testing::Random random(8);
  std::vector<Parameter> parameters(1 << 20);
  for (Parameter& at : parameters) {
    at = {random.Below(face_count), (random.Signed() + 1) / 2, (random.Signed() + 1) / 2};
    if (at.u + at.v > 1) at = {at.face, 1 - at.u, 1 - at.v};
  }
  return parameters;
}

void BuildLimitEvaluator(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus();
  for (auto _ : state) benchmark::DoNotOptimize(LimitEvaluator::Build(mesh, RunContext()));
}
BENCHMARK(BuildLimitEvaluator)->Unit(benchmark::kMillisecond);

// Argument: the order of the derivatives.
void EvaluateAnywhere(benchmark::State& state) {
  const auto evaluator = LimitEvaluator::Build(BumpyTorus(), RunContext());
  const std::vector<Parameter> parameters = RandomParameters(evaluator->face_count());
  const JetOrder order = static_cast<JetOrder>(state.range(0));
  for (auto _ : state) {
    for (const Parameter& at : parameters) {
      benchmark::DoNotOptimize(evaluator->At(at.face, at.u, at.v, order));
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(parameters.size()));
}
BENCHMARK(EvaluateAnywhere)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

// With heights, many places in one call. Arguments: the order of the derivatives; 1 for places in
// the order of their faces; places in one call.
void EvaluateMany(benchmark::State& state) {
  DisplacedSurface surface;
  surface.control_mesh = BumpyTorus();
  surface.max_level = 3;
  const auto control = BuildMeshTopology(surface.control_mesh.faces,
                                         static_cast<int>(surface.control_mesh.vertices.cols()));
  const FaceVertices vertices(*control, surface.max_level);
  surface.heights.assign(static_cast<size_t>(vertices.count()), 1e-3f);
  surface.sources.assign(surface.heights.size(), HeightSource::kMeasured);
  const auto evaluator = DisplacedEvaluator::Build(surface, RunContext());
  std::vector<DisplacedEvaluator::Parameter> parameters;
  for (const Parameter& at : RandomParameters(evaluator->face_count())) {
    parameters.push_back({at.face, at.u, at.v});
  }
  if (state.range(1) != 0) {
    std::sort(parameters.begin(), parameters.end(),
              [](const auto& a, const auto& b) { return a.face < b.face; });
  }
  const auto order = static_cast<JetOrder>(state.range(0));
  const auto at_once = static_cast<size_t>(state.range(2));
  std::vector<SurfaceJet> jets(at_once);
  for (auto _ : state) {
    for (size_t i = 0; i < parameters.size(); i += at_once) {
      evaluator->AtAll({&parameters[i], at_once}, order, jets.data());
      benchmark::DoNotOptimize(jets.data());
      benchmark::ClobberMemory();
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(parameters.size()));
}
BENCHMARK(EvaluateMany)->ArgsProduct({{0, 1, 2}, {0, 1}, {1, 256}})->Unit(benchmark::kMillisecond);

// Arguments: levels of isolation; the order of the derivatives.
void EvaluateWithBfr(benchmark::State& state) {
  namespace Bfr = OpenSubdiv::OPENSUBDIV_VERSION::Bfr;
  namespace Far = OpenSubdiv::OPENSUBDIV_VERSION::Far;
  namespace Sdc = OpenSubdiv::OPENSUBDIV_VERSION::Sdc;
  const ControlMesh mesh = BumpyTorus();
  const int face_count = static_cast<int>(mesh.faces.cols());
  const std::vector<int> corners(static_cast<size_t>(face_count), 3);
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(mesh.vertices.cols());
  descriptor.numFaces = face_count;
  descriptor.numVertsPerFace = corners.data();
  descriptor.vertIndicesPerFace = mesh.faces.data();
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  const std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_LOOP, Sdc::Options())));
  Bfr::SurfaceFactory::Options options;
  options.SetApproxLevelSmooth(static_cast<int>(state.range(0)));
  const Bfr::RefinerSurfaceFactory<> factory(*refiner, options);
  std::vector<std::unique_ptr<Bfr::Surface<double>>> surfaces;
  std::vector<std::vector<double>> points;
  for (int f = 0; f < face_count; ++f) {
    surfaces.emplace_back(factory.CreateVertexSurface<double>(f));
    points.emplace_back(static_cast<size_t>(surfaces.back()->GetNumPatchPoints()) * 3);
    surfaces.back()->PreparePatchPoints(mesh.vertices.data(), {3, 3}, points.back().data(), {3, 3});
  }
  const std::vector<Parameter> parameters = RandomParameters(face_count);
  double position[3], u[3], v[3], uu[3], uv[3], vv[3];
  for (auto _ : state) {
    for (const Parameter& at : parameters) {
      const size_t f = static_cast<size_t>(at.face);
      const double where[2] = {at.u, at.v};
      if (state.range(1) == 0) {
        surfaces[f]->Evaluate(where, points[f].data(), {3, 3}, position);
      } else if (state.range(1) == 1) {
        surfaces[f]->Evaluate(where, points[f].data(), {3, 3}, position, u, v);
      } else {
        surfaces[f]->Evaluate(where, points[f].data(), {3, 3}, position, u, v, uu, uv, vv);
      }
      benchmark::DoNotOptimize(position);
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(parameters.size()));
}
BENCHMARK(EvaluateWithBfr)->ArgsProduct({{2, 10}, {0, 1, 2}})->Unit(benchmark::kMillisecond);

// A million points around a surface of 100 000 triangles, as of a scan that is inspected: in the
// order of a walk over it, and in no order. Argument: 1 for no order. Items are points.
void FindClosestPoints(benchmark::State& state) {
  DisplacedSurface surface;
  surface.control_mesh = testing::Torus(40, 20);
  surface.max_level = 3;
  testing::Random random(9);
  const auto control = BuildMeshTopology(surface.control_mesh.faces, 40 * 20);
  const FaceVertices vertices(*control, surface.max_level);
  for (int64_t v = 0; v < vertices.count(); ++v) {
    surface.heights.push_back(static_cast<float>(1e-3 * random.Signed()));
  }
  surface.sources.assign(surface.heights.size(), HeightSource::kMeasured);
  const auto finder = ClosestPointFinder::Build(surface, RunContext());
  std::vector<Parameter> parameters = RandomParameters(finder->evaluator().face_count());
  parameters.resize(1000000);
  if (state.range(0) == 0) {
    std::sort(parameters.begin(), parameters.end(),
              [](const Parameter& a, const Parameter& b) { return a.face < b.face; });
  }
  Eigen::Matrix3Xd places(3, 1000000);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const Parameter& at = parameters[static_cast<size_t>(i)];
    places.col(i) = finder->evaluator().At(at.face, at.u, at.v, JetOrder::kPosition).position +
                    1e-3 * random.Vector();
  }
  for (auto _ : state) benchmark::DoNotOptimize(finder->Find(places, RunContext()));
  state.SetItemsProcessed(state.iterations() * places.cols());
}
BENCHMARK(FindClosestPoints)->DenseRange(0, 1)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace rilievo
