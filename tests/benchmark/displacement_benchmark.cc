// Sampling 65 538 heights of a wavy sphere from 100 000 points, and the parts of it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/displacement/sample_displacement.h"
#include "core/points/morton_order.h"
#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr int kPoints = 100'000;
constexpr double kRadius = 0.28;

double WavyRadius(const Eigen::Vector3d& direction) {
  const Eigen::Array3d waves = (12 * direction.array()).sin();
  return kRadius + 0.01 * waves.prod();
}

// In Morton order, as the stage expects its points. `noise`: along the radius, in spacings.
Scan WavyScan(double noise) {
  const double spacing = 4 * kRadius / std::sqrt(static_cast<double>(kPoints));
  Random random(1);
  Points points;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, kPoints);
    const Eigen::Vector3d u = direction.unitOrthogonal(), v = direction.cross(u);
    const auto at = [&](double along_u, double along_v) -> Eigen::Vector3d {
      const Eigen::Vector3d moved = (direction + along_u * u + along_v * v).normalized();
      return moved * WavyRadius(moved);
    };
    constexpr double kStep = 1e-5;
    points.Add(at(0, 0) + noise * spacing * Gauss(&random) * direction,
               (at(kStep, 0) - at(-kStep, 0)).cross(at(0, kStep) - at(0, -kStep)));
  }
  const Eigen::Matrix3Xd positions = points.Positions(), normals = points.Normals();
  const std::vector<int> order = ComputeMortonOrder(positions, RunContext())->order;
  return MakeScan(positions(Eigen::all, order), normals(Eigen::all, order), noise * spacing);
}

Domain SphereDomain() { return MakeDomain(Octahedron(kRadius, 3), 4); }

RunContext ThreadsOf(int64_t threads) { return Threads(static_cast<int>(threads)); }

void BM_SampleDisplacement(benchmark::State& state) {
  const Scan scan = WavyScan(1e-3 * static_cast<double>(state.range(0)));
  const Domain domain = SphereDomain();
  const RunContext context = ThreadsOf(state.range(1));
  DisplacementField field;
  for (auto _ : state) {
    auto sampled = SampleDisplacement(scan.cloud, domain.refinement, domain.rings, domain.limit,
                                      DisplacementOptions(), context);
    if (!sampled.ok()) {
      state.SkipWithError(std::string(sampled.status().message()).c_str());
      return;
    }
    field = *std::move(sampled);
  }
  double squares = 0;
  for (int v = 0; v < domain.size(); ++v) {
    const Eigen::Vector3d at =
        domain.limit.positions.col(v) + field.heights[v] * domain.limit.normals.col(v);
    squares += std::pow(at.norm() - WavyRadius(at.normalized()), 2);
  }
  state.counters["heights"] = domain.size();
  state.counters["smoothed"] = static_cast<double>(field.smoothed);
  state.counters["filled"] = static_cast<double>(field.filled);
  state.counters["rms_ppm"] = 1e6 * std::sqrt(squares / domain.size());
}
BENCHMARK(BM_SampleDisplacement)
    ->ArgNames({"noise_permille", "threads"})
    ->ArgsProduct({{0, 250, 750}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace rilievo
