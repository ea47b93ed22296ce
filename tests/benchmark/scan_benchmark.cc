// The scan stages at 100 000 points.
#include <benchmark/benchmark.h>

#include "core/scan/clean/check_scan.h"
#include "core/scan/clean/remove_outliers.h"
#include "core/scan/local_shape/estimate_normals.h"
#include "core/scan/orientation/orient_normals.h"
#include "core/scan/scan_surface.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

const PointCloud& Scan() {
  static const PointCloud cloud = [] {
    ScannerOptions options;
    options.points = 100000;
    options.noise = 0.0005;
    return SimulateScan(*MakeGenus2(), options).value().cloud;
  }();
  return cloud;
}

const CheckedScan& Checked() {
  static const CheckedScan checked = CheckScan(Scan(), CheckOptions{}, RunContext{}).value();
  return checked;
}

const NeighborGraph& Graph() {
  static const NeighborGraph graph =
      BuildNeighborGraph(PointIndex(Checked().points), Checked().points, NeighborOptions{},
                         RunContext{})
          .value();
  return graph;
}

void BM_CheckScan(benchmark::State& state) {
  Scan();
  for (auto _ : state) benchmark::DoNotOptimize(CheckScan(Scan(), CheckOptions{}, RunContext{}));
}
BENCHMARK(BM_CheckScan)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_BuildNeighborGraph(benchmark::State& state) {
  for (auto _ : state) {
    const PointIndex index(Checked().points);
    benchmark::DoNotOptimize(
        BuildNeighborGraph(index, Checked().points, NeighborOptions{}, RunContext{}));
  }
}
BENCHMARK(BM_BuildNeighborGraph)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_FindOutliers(benchmark::State& state) {
  Graph();
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        FindOutliers(Checked().points, Graph(), OutlierOptions{}, RunContext{}));
  }
}
BENCHMARK(BM_FindOutliers)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_EstimateNormals(benchmark::State& state) {
  Graph();
  for (auto _ : state) {
    benchmark::DoNotOptimize(EstimateNormals(Checked().points, Graph(), {}, {}, RunContext{}));
  }
}
BENCHMARK(BM_EstimateNormals)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_OrientNormals(benchmark::State& state) {
  const OrientedCloud cloud =
      EstimateNormals(Checked().points, Graph(), {}, {}, RunContext{}).value().cloud;
  for (auto _ : state) {
    OrientedCloud oriented = cloud;
    benchmark::DoNotOptimize(OrientNormals(Graph(), {}, {}, &oriented, RunContext{}));
  }
}
BENCHMARK(BM_OrientNormals)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace rilievo
