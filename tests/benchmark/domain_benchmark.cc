// The domain fit at 100 000 points: time against control faces, and the parts of it.
#include <benchmark/benchmark.h>

#include "core/domain/fit_loop_domain.h"
#include "core/domain/foot_points.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

constexpr int kPoints = 100'000;

// About `faces` triangles, nearly equilateral.
ControlMesh Torus(int64_t faces) {
  const int across = static_cast<int>(std::lround(std::sqrt(static_cast<double>(faces) / 5)));
  return TorusMesh(0.25, 0.1, static_cast<int>(faces) / (2 * across), across);
}

void FitTorus(benchmark::State& state, FitMethod method) {
  const OrientedCloud cloud = TorusCloud(0.25, 0.1, kPoints);
  const PointIndex index(cloud.points);
  const ControlMesh mesh = Torus(state.range(0));
  FitOptions options;
  options.method = method;
  if (method == FitMethod::kSuzuki) options.suzuki_rounds = 4;
  RunContext context;
  context.threads = 2;
  double rms = 0;
  for (auto _ : state) {
    const auto fit = FitLoopDomain(cloud, index, mesh, options, context);
    if (!fit.ok()) state.SkipWithError(std::string(fit.status().message()).c_str());
    rms = fit->rms_after;
  }
  state.counters["rms_ppm"] = rms * 1e6;
  state.counters["control_faces"] = static_cast<double>(mesh.faces.cols());
}
void BM_LeastSquares(benchmark::State& state) { FitTorus(state, FitMethod::kLeastSquares); }
void BM_Suzuki(benchmark::State& state) { FitTorus(state, FitMethod::kSuzuki); }
BENCHMARK(BM_LeastSquares)
    ->Arg(750)
    ->Arg(1500)
    ->Arg(3000)
    ->Arg(6000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(BM_Suzuki)
    ->Arg(3000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

void BM_BuildDomainSamples(benchmark::State& state) {
  const ControlMesh mesh = Torus(state.range(0));
  RunContext context;
  context.threads = 2;
  for (auto _ : state) benchmark::DoNotOptimize(BuildDomainSamples(mesh, 2, context));
}
BENCHMARK(BM_BuildDomainSamples)
    ->Arg(3000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

// One search after the first, which alone goes through a tree.
void BM_FootPoints(benchmark::State& state) {
  const OrientedCloud cloud = TorusCloud(0.25, 0.1, kPoints);
  const PointIndex index(cloud.points);
  const ControlMesh mesh = Torus(state.range(0));
  RunContext context;
  context.threads = 2;
  const DomainSamples samples = *BuildDomainSamples(mesh, 2, context);
  SampledSurface surface;
  FootPoints feet;
  FootPointSearch search(cloud, index, samples, 2.0);
  bool good = SampleSurface(samples, mesh.vertices, context, &surface).ok() &&
              search.Update(surface, context, &feet).ok();
  for (auto _ : state) good = good && search.Update(surface, context, &feet).ok();
  if (!good) state.SkipWithError("foot point search failed");
}
BENCHMARK(BM_FootPoints)
    ->Arg(3000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace rilievo
