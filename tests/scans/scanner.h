// A virtual scanner: analytic shapes seen from K viewpoints, with the faults of real scans.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"
#include "tests/scans/analytic_shape.h"

namespace rilievo {

struct ScannerOptions {
  // Points delivered, outliers included. [1, 2e8].
  int64_t points = 100000;
  // Viewpoints, spread evenly over the sphere around the shape (over a cap above it when the shape
  // is open), each taking an equal share of the points. [1, 1000]; 0: no scanner at all, points
  // uniform over the whole area, nothing occluded.
  int views = 12;
  // Distance of the viewpoints from the centre, in radii of the bounding sphere. [1.2, 100]. Rays
  // spread evenly in angle, so the density falls with the square of the distance: the nearer, the
  // less even.
  double view_distance = 3.0;
  // A further fall: a return from distance d is kept with probability (nearest / d)^falloff. >= 0.
  double falloff = 0.0;
  // Standard deviation of the range error, along the ray; fraction of the diagonal. Normal to the
  // surface when views is 0. [0, 0.1].
  double noise = 0.0;
  // Share of the points replaced by points uniform in the bounding box enlarged by a fifth. [0,
  // 0.9].
  double outliers = 0.0;
  // Returns lost at random. [0, 0.95].
  double dropout = 0.0;
  // No return comes from a surface seen at a flatter angle (from its normal). (0, 90], degrees.
  double max_incidence_degrees = 80.0;
  uint64_t seed = 1;
  absl::Status Validate() const;
};

// Points in random order. Without noise each point that is not an outlier lies on the shape to
// rounding.
struct SimulatedScan {
  PointCloud cloud;
  Eigen::Matrix3Xd normals;  // true outward unit normal where the ray met the surface; 0 if none
  std::vector<int> view;     // viewpoint that saw the point; -1: outlier or views == 0
  std::vector<uint8_t> outlier;  // 1: a false point
  Eigen::Matrix3Xd viewpoints;   // column = position
};

// Same shape, options and seed: same bytes. INVALID_ARGUMENT for options out of range,
// FAILED_PRECONDITION when a viewpoint meets the shape too seldom to deliver its share.
absl::StatusOr<SimulatedScan> SimulateScan(const AnalyticShape& shape,
                                           const ScannerOptions& options);

// Exact distance of points to the shape, in the shape's unit.
struct ShapeError {
  double rms = 0, mean = 0, max = 0;
};
ShapeError MeasureAgainstShape(const AnalyticShape& shape, const Eigen::Matrix3Xd& points);

}  // namespace rilievo
