// The control room: simplification of iso-surfaces, the cheap topologies and the choice among them.
#include <benchmark/benchmark.h>

#include "core/control/arbitrary_control_mesh.h"
#include "core/control/build_control_mesh.h"
#include "core/control/choose_topology.h"
#include "core/control/planar/planar_control_mesh.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/spherical/spherical_control_mesh.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

double Bumpy(const Eigen::Vector3d& x) {
  return (x - kOffset).norm() - 0.33 -
         0.04 * std::sin(12 * x.x()) * std::sin(12 * x.y()) * std::sin(12 * x.z());
}

// Argument: cubes along a side. 90: about 100 000 faces; 156: about 300 000.
void BM_SimplifyMesh(benchmark::State& state) {
  const ControlMesh mesh = MarchTetrahedra(Bumpy, static_cast<int>(state.range(0)));
  SimplifyOptions options;
  options.target_faces = 3000;
  for (auto _ : state) {
    auto result = SimplifyMesh(mesh, options, RunContext());
    benchmark::DoNotOptimize(result);
  }
  state.counters["faces_in"] = static_cast<double>(mesh.faces.cols());
  state.counters["faces_per_second"] = benchmark::Counter(
      static_cast<double>(mesh.faces.cols()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BM_SimplifyMesh)->Arg(90)->Arg(156)->Unit(benchmark::kMillisecond);

void BM_ImproveAndRelax(benchmark::State& state) {
  SimplifyOptions options;
  options.target_faces = 6000;
  const auto simplified = SimplifyMesh(MarchTetrahedra(Bumpy, 90), options, RunContext());
  for (auto _ : state) {
    ControlMesh mesh = *simplified;
    ImproveValence(&mesh, 40);
    RelaxTangentially(&mesh, 3);
    benchmark::DoNotOptimize(mesh);
  }
}
BENCHMARK(BM_ImproveAndRelax)->Unit(benchmark::kMillisecond);

void BM_PlanarControlMesh(benchmark::State& state) {
  const OrientedCloud cloud = TerrainCloud(100000, 0.1);
  for (auto _ : state) {
    auto mesh = PlanarControlMesh(cloud, BoundaryRule::kKeep, 3000, RunContext());
    benchmark::DoNotOptimize(mesh);
  }
}
BENCHMARK(BM_PlanarControlMesh)->Unit(benchmark::kMillisecond);

void BM_SphericalControlMesh(benchmark::State& state) {
  const OrientedCloud cloud = StarCloud(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    auto mesh = SphericalControlMesh(cloud, 8192, RunContext());
    benchmark::DoNotOptimize(mesh);
  }
}
BENCHMARK(BM_SphericalControlMesh)->Arg(9218)->Arg(100000)->Unit(benchmark::kMillisecond);

void BM_ChooseTopology(benchmark::State& state) {
  const OrientedCloud cloud = StarCloud(100000);
  for (auto _ : state) {
    auto choice = ChooseTopology(cloud, RunContext{});
    benchmark::DoNotOptimize(choice);
  }
}
BENCHMARK(BM_ChooseTopology)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rilievo
