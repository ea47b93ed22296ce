// Encoding and decoding of 204 800 heights over 800 control points, and what they weigh.
#include <cmath>
#include <numbers>

#include "benchmark/benchmark.h"
#include "core/codec/container/dss.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// A torus with waves for heights; `noise` of the diagonal, uniform.
DisplacedSurface WavyTorus(double noise) {
  constexpr int kRows = 40, kColumns = 20, kLevel = 4;
  ControlMesh mesh;
  mesh.vertices.resize(3, kRows * kColumns);
  mesh.faces.resize(3, 2 * kRows * kColumns);
  int f = 0;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j) {
      const double u = 2 * std::numbers::pi * i / kRows, v = 2 * std::numbers::pi * j / kColumns;
      const double radius = 0.3 + 0.12 * std::cos(v);
      mesh.vertices.col(i * kColumns + j) << radius * std::cos(u), radius * std::sin(u),
          0.12 * std::sin(v);
      const int a = i * kColumns + j, b = (i + 1) % kRows * kColumns + j;
      const int c = (i + 1) % kRows * kColumns + (j + 1) % kColumns,
                d = i * kColumns + (j + 1) % kColumns;
      mesh.faces.col(f++) << a, b, c;
      mesh.faces.col(f++) << a, c, d;
    }
  }
  DisplacedSurface surface;
  surface.control_mesh = *PrepareControlMesh(mesh, kPositionStep);
  surface.max_level = kLevel;
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, kLevel, RunContext());
  const LimitSurface limit =
      *EvaluateLimit(refinement, surface.control_mesh.vertices, kLevel, RunContext());
  uint32_t random = 1;
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    random = random * 1664525u + 1013904223u;
    const Eigen::Vector3d p = limit.positions.col(v);
    const double wave = 0.004 * std::sin(40 * p[0]) * std::cos(35 * p[1] + 20 * p[2]);
    surface.heights.push_back(static_cast<float>(wave + noise * (random * 0x1p-31 - 1)));
    surface.sources.push_back(p[0] > 0.35 ? HeightSource::kFilled : HeightSource::kMeasured);
  }
  return surface;
}

// Argument: noise in millionths of the diagonal.
void BM_Encode(benchmark::State& state) {
  const DisplacedSurface surface = WavyTorus(1e-6 * static_cast<double>(state.range(0)));
  EncodedSurface encoded;
  for (auto _ : state) encoded = *EncodeDss(surface, {}, {}, RunContext());
  const double heights = static_cast<double>(surface.heights.size());
  state.counters["bytes"] = static_cast<double>(encoded.Concatenate().size());
  state.counters["control_bits"] = 8.0 * static_cast<double>(encoded.chunks[0].size()) /
                                   static_cast<double>(surface.control_mesh.vertices.cols());
  state.counters["height_bits"] =
      8.0 * static_cast<double>(encoded.Concatenate().size() - encoded.chunks[0].size()) / heights;
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(surface.heights.size()));
}
BENCHMARK(BM_Encode)->Arg(0)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

// Argument: RMS error asked for, in millionths of the diagonal; over noise of 0.01 %.
void BM_EncodeWithinError(benchmark::State& state) {
  const DisplacedSurface surface = WavyTorus(1e-4);
  EncodeOptions options;
  options.max_error = 1e-6 * static_cast<double>(state.range(0));
  EncodedSurface encoded;
  for (auto _ : state) encoded = *EncodeDss(surface, {}, options, RunContext());
  state.counters["bytes"] = static_cast<double>(encoded.Concatenate().size());
  state.counters["rms"] = encoded.height_rms;
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(surface.heights.size()));
}
BENCHMARK(BM_EncodeWithinError)->Arg(30)->Arg(100)->Arg(300)->Unit(benchmark::kMillisecond);

void BM_Decode(benchmark::State& state) {
  const DisplacedSurface surface = WavyTorus(1e-6 * static_cast<double>(state.range(0)));
  const std::vector<uint8_t> bytes = EncodeDss(surface, {}, {}, RunContext())->Concatenate();
  for (auto _ : state) benchmark::DoNotOptimize(DecodeDss(bytes, RunContext()));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(surface.heights.size()));
}
BENCHMARK(BM_Decode)->Arg(0)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rilievo
