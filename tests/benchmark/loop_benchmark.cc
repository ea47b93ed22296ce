// Connectivity, refinement, limit evaluation and stencils. Counters: items are faces or vertices.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/mesh_topology.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// A bumpy torus with the given number of faces or a few more; every ninth quad has its diagonal
// turned, so that valences run from 4 to 8.
ControlMesh BumpyTorus(int face_count) {
  const int across = static_cast<int>(std::sqrt(face_count / 4.0)), around = 2 * across;
  ControlMesh mesh;
  mesh.vertices.resize(3, around * across);
  mesh.faces.resize(3, 2 * around * across);
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double u = 2.0 * M_PI * i / around, v = 2.0 * M_PI * j / across;
      const double tube = 0.3 + 0.03 * std::sin(5 * u) * std::cos(3 * v);
      const double radius = 1.0 + tube * std::cos(v);
      const int a = i * across + j, b = (i + 1) % around * across + j;
      const int d = i * across + (j + 1) % across;
      const int c = (i + 1) % around * across + (j + 1) % across;
      mesh.vertices.col(a) << radius * std::cos(u), radius * std::sin(u), tube * std::sin(v);
      const bool turned = a % 9 == 0;
      mesh.faces.col(2 * a) << a, b, turned ? d : c;
      mesh.faces.col(2 * a + 1) << (turned ? b : a), c, d;
    }
  }
  return mesh;
}

// The same torus with every fourth ring and every fourth meridian sharp: corners where they cross,
// and about one edge in six tagged. `sharpness` as in Crease.
ControlMesh CreasedTorus(int face_count, float sharpness) {
  ControlMesh mesh = BumpyTorus(face_count);
  const int across = static_cast<int>(std::sqrt(face_count / 4.0)), around = 2 * across;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const int a = i * across + j;
      const int b = (i + 1) % around * across + j, d = i * across + (j + 1) % across;
      if (j % 4 == 0) mesh.creases.push_back({std::min(a, b), std::max(a, b), sharpness});
      if (i % 4 == 0) mesh.creases.push_back({std::min(a, d), std::max(a, d), sharpness});
    }
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& x, const Crease& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
  return mesh;
}

RunContext Threads(int threads) {
  RunContext context;
  context.threads = threads;
  return context;
}

void SummarizeTopology(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus(static_cast<int>(state.range(0)));
  const int vertex_count = static_cast<int>(mesh.vertices.cols());
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::SummarizeTopology(mesh.faces, vertex_count));
  }
  state.SetItemsProcessed(state.iterations() * mesh.faces.cols());
}
BENCHMARK(SummarizeTopology)->Arg(400000)->Unit(benchmark::kMillisecond);

void BuildMeshTopology(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus(static_cast<int>(state.range(0)));
  const int vertex_count = static_cast<int>(mesh.vertices.cols());
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::BuildMeshTopology(mesh.faces, vertex_count));
  }
  state.SetItemsProcessed(state.iterations() * mesh.faces.cols());
}
BENCHMARK(BuildMeshTopology)->Arg(400000)->Unit(benchmark::kMillisecond);

void BuildVertexRings(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus(static_cast<int>(state.range(0)));
  const auto topology =
      rilievo::BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  for (auto _ : state) benchmark::DoNotOptimize(rilievo::BuildVertexRings(*topology));
  state.SetItemsProcessed(state.iterations() * mesh.faces.cols());
}
BENCHMARK(BuildVertexRings)->Arg(400000)->Unit(benchmark::kMillisecond);

// Arguments: control faces, level, threads.
void RefineTopology(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus(static_cast<int>(state.range(0)));
  const int level = static_cast<int>(state.range(1));
  const RunContext context = Threads(static_cast<int>(state.range(2)));
  for (auto _ : state) benchmark::DoNotOptimize(rilievo::RefineTopology(mesh, level, context));
  state.SetItemsProcessed(state.iterations() * (mesh.faces.cols() << (2 * level)));
}
BENCHMARK(RefineTopology)
    ->Args({5000, 4, 1})
    ->Args({5000, 4, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void EvaluateLimit(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus(static_cast<int>(state.range(0)));
  const int level = static_cast<int>(state.range(1));
  const RunContext context = Threads(static_cast<int>(state.range(2)));
  const auto refinement = rilievo::RefineTopology(mesh, level, context);
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::EvaluateLimit(*refinement, mesh.vertices, level, context));
  }
  state.SetItemsProcessed(state.iterations() * refinement->levels.back().vertex_count);
}
BENCHMARK(EvaluateLimit)
    ->Args({5000, 4, 1})
    ->Args({5000, 4, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BuildLimitStencils(benchmark::State& state) {
  const ControlMesh mesh = BumpyTorus(static_cast<int>(state.range(0)));
  const int level = static_cast<int>(state.range(1));
  const RunContext context = Threads(static_cast<int>(state.range(2)));
  const auto refinement = rilievo::RefineTopology(mesh, level, context);
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::BuildLimitStencils(*refinement, level, context));
  }
  state.SetItemsProcessed(state.iterations() * refinement->levels.back().vertex_count);
}
BENCHMARK(BuildLimitStencils)
    ->Args({3000, 2, 1})
    ->Args({3000, 2, 2})
    ->Args({3000, 3, 1})
    ->Args({3000, 3, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// The same work on a mesh with creases. Arguments: control faces, level, sharpness.
void RefineCreased(benchmark::State& state) {
  const ControlMesh mesh =
      CreasedTorus(static_cast<int>(state.range(0)), static_cast<float>(state.range(2)));
  const int level = static_cast<int>(state.range(1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::RefineTopology(mesh, level, Threads(1)));
  }
  state.SetItemsProcessed(state.iterations() * (mesh.faces.cols() << (2 * level)));
}
BENCHMARK(RefineCreased)->Args({5000, 4, 10})->Args({5000, 4, 3})->Unit(benchmark::kMillisecond);

void EvaluateCreased(benchmark::State& state) {
  const ControlMesh mesh =
      CreasedTorus(static_cast<int>(state.range(0)), static_cast<float>(state.range(2)));
  const int level = static_cast<int>(state.range(1));
  const auto refinement = rilievo::RefineTopology(mesh, level, Threads(1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::EvaluateLimit(*refinement, mesh.vertices, level, Threads(1)));
  }
  state.SetItemsProcessed(state.iterations() * refinement->levels.back().vertex_count);
}
BENCHMARK(EvaluateCreased)->Args({5000, 4, 10})->Args({5000, 4, 3})->Unit(benchmark::kMillisecond);

void CreasedStencils(benchmark::State& state) {
  const ControlMesh mesh =
      CreasedTorus(static_cast<int>(state.range(0)), static_cast<float>(state.range(2)));
  const int level = static_cast<int>(state.range(1));
  const auto refinement = rilievo::RefineTopology(mesh, level, Threads(1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(rilievo::BuildLimitStencils(*refinement, level, Threads(1)));
  }
  state.SetItemsProcessed(state.iterations() * refinement->levels.back().vertex_count);
}
BENCHMARK(CreasedStencils)->Args({3000, 3, 10})->Args({3000, 3, 3})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rilievo
