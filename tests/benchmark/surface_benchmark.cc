// Tessellation and the two-sided error. The figure of the design: 200 000 samples against 200 000
// triangles.
#include <cmath>
#include <numbers>

#include "benchmark/benchmark.h"
#include "core/loop/refinement.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {
namespace {

// A torus of rows x columns quads cut in two, its tube `bump` thicker and thinner in waves.
Shape TorusShape(int rows, int columns, double bump) {
  Shape shape;
  shape.vertices.resize(3, rows * columns);
  shape.triangles.resize(3, 2 * rows * columns);
  int f = 0;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double u = 2 * std::numbers::pi * i / rows, v = 2 * std::numbers::pi * j / columns;
      const double tube = 0.12 + bump * std::sin(31 * u) * std::cos(13 * v);
      const double radius = 0.3 + tube * std::cos(v);
      shape.vertices.col(i * columns + j) << radius * std::cos(u), radius * std::sin(u),
          tube * std::sin(v);
      const int a = i * columns + j, b = (i + 1) % rows * columns + j;
      const int c = (i + 1) % rows * columns + (j + 1) % columns,
                d = i * columns + (j + 1) % columns;
      shape.triangles.col(f++) << a, b, c;
      shape.triangles.col(f++) << a, c, d;
    }
  }
  return shape;
}

void BM_BuildTree(benchmark::State& state) {
  const Shape shape = TorusShape(500, 200, 1e-3);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        ClosestPointTree::Build(shape.vertices, shape.triangles, RunContext()));
  }
  state.SetItemsProcessed(state.iterations() * shape.triangles.cols());
}
BENCHMARK(BM_BuildTree)->Unit(benchmark::kMillisecond)->UseRealTime();

// Both directions: two trees, 2 x 200 000 samples and 2 x 100 000 vertices.
void BM_MeasureTwoSided(benchmark::State& state) {
  const Shape a = TorusShape(500, 200, 1e-3), b = TorusShape(400, 250, 0);
  for (auto _ : state) benchmark::DoNotOptimize(MeasureTwoSided(a, b, {}, RunContext()));
}
BENCHMARK(BM_MeasureTwoSided)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_MeasureAgainstPoints(benchmark::State& state) {
  const Shape a = TorusShape(500, 200, 1e-3);
  Shape points = TorusShape(400, 250, 0);
  points.triangles.resize(3, 0);
  for (auto _ : state) benchmark::DoNotOptimize(MeasureTwoSided(a, points, {}, RunContext()));
}
BENCHMARK(BM_MeasureAgainstPoints)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_Tessellate(benchmark::State& state) {
  const Shape torus = TorusShape(40, 20, 0);
  DisplacedSurface surface;
  surface.control_mesh = {torus.vertices, torus.triangles};
  surface.max_level = 4;
  const int count = 40 * 20 * 256;
  surface.heights.assign(count, 0.001f);
  surface.sources.assign(count, HeightSource::kMeasured);
  const int level = static_cast<int>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(Tessellate(surface, level, RunContext()));
  state.SetItemsProcessed(state.iterations() * (40 * 20 << (2 * level)));
}
BENCHMARK(BM_Tessellate)->Arg(3)->Arg(4)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace rilievo
