// The whole road from points to bytes, by the number of points.
#include <benchmark/benchmark.h>

#include "core/pipeline/reconstruct.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

void BM_Reconstruct(benchmark::State& state) {
  ScannerOptions options;
  options.points = state.range(0);
  options.noise = 0.0005;
  const PointCloud cloud = SimulateScan(*MakeGenus2(), options).value().cloud;
  for (auto _ : state) {
    benchmark::DoNotOptimize(Reconstruct(cloud, ReconstructOptions{}, RunContext{}));
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_Reconstruct)
    ->Arg(10000)
    ->Arg(100000)
    ->Arg(500000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace rilievo
