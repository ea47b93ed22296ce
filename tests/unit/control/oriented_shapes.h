// Clouds of the simulator with true normals: what the control stage receives on a good day.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {

struct OrientedShape {
  OrientedCloud cloud;  // shape frame divided by the shape's diagonal
  PointIndex index;
  NeighborGraph graph;
  double scale;  // shape = unit * scale
};

// Uniform samples of `shape` with true normals and a common spacing.
inline OrientedShape OrientShape(const AnalyticShape& shape, int points, double area,
                                 double noise = 0, uint64_t seed = 1) {
  ScannerOptions options;
  options.points = points;
  options.views = 0;
  options.noise = noise;
  options.seed = seed;
  const SimulatedScan scan = SimulateScan(shape, options).value();
  const double scale = shape.diagonal();
  OrientedCloud cloud;
  cloud.points = scan.cloud.points / scale;
  cloud.normals = scan.normals;
  const double spacing = std::sqrt(4 / std::numbers::pi * area / points) / scale;
  cloud.spacing.assign(points, static_cast<float>(spacing));
  cloud.noise.assign(points, static_cast<float>(noise));
  cloud.median_spacing = spacing;
  cloud.median_noise = noise;
  PointIndex index(cloud.points);
  NeighborGraph graph =
      BuildNeighborGraph(index, cloud.points, NeighborOptions{}, RunContext{}).value();
  return {std::move(cloud), std::move(index), std::move(graph), scale};
}

inline constexpr double kTorusArea = 4 * std::numbers::pi * std::numbers::pi * 0.7 * 0.28;
inline constexpr double kSphereArea = 4 * std::numbers::pi;

}  // namespace rilievo
