// A new scan held against a surface that is there already.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/spatial_frame.h"
#include "core/points/settings.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// Where the points of a scan lie.
struct PointsOnSurface {
  Eigen::Matrix3Xd points;    // those that are finite; unit frame of the surface, Morton order
  std::vector<float> away;    // distance of each from the nearest triangle
  std::vector<float> across;  // from its plane, positive before its front; 0 beyond a border
  std::vector<int> triangle;  // that one
  int64_t non_finite = 0;
  // Standard deviation of `across` from one point to the next one: noise of the scan, whatever the
  // surface is like.
  double noise = 0;
};

// `surface`: FinestTriangles(). INVALID_ARGUMENT without a finite point; CANCELLED.
absl::StatusOr<PointsOnSurface> LayOnSurface(const PointCloud& scan, const SpatialFrame& frame,
                                             const Shape& surface, const RunContext& context);

// The same points on another surface, whose triangles they name then; of those where `again`
// is 0 nothing changes.
absl::Status LayAgain(const Shape& surface, const std::vector<uint8_t>& again,
                      const RunContext& context, PointsOnSurface* points);

// Triangles of the finest level, by the four, sixteen, ... that come of one: patch p has those from
// p * triangles_each on.
struct ScannedPatches {
  int triangles_each = 1;
  std::vector<uint8_t> seen;          // by patch: points lie on it
  std::vector<uint8_t> contradicted;  // by patch
};

// Patches as small as the points allow: half of those that are seen have kCommon.fewest_of_plane
// or more. A patch of n points is contradicted where the median m of `across` is too large for the
// noise of the scan and the error of the surface, a standard deviation each:
//   |m| > sqrt(2 ln N) sqrt(pi / 2 noise^2 / n + error^2),
// as the median of n normal numbers has the variance pi / (2 n), and the largest of N normal
// numbers is about sqrt(2 ln N) (Donoho and Johnstone, Biometrika 81, 1994); N: patches that are
// seen. So a change is told that is smaller than the noise of a point, and a few outliers tell
// none.
ScannedPatches CompareWithSurface(const PointsOnSurface& points, const Shape& surface,
                                  double surface_error);

DistanceSummary SummaryOf(const std::vector<float>& away);

}  // namespace rilievo
