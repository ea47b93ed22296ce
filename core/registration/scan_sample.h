// A scan as registration sees it: a few of its points, with their normals.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/spatial_frame.h"
#include "core/points/point_index.h"

namespace rilievo {

// In a unit frame that all scans share; the points in Morton order.
struct ScanSample {
  Eigen::Matrix3Xd points;
  Eigen::Matrix3Xd normals;    // unit, on the outer side
  std::vector<float> spacing;  // as in OrientedCloud, of these points
  double median_spacing = 0, median_noise = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // mean of the points
  PointIndex index;                                  // of the points
};

struct SampledScans {
  std::vector<ScanSample> samples;
  SpatialFrame frame;  // the box of all samples
};

// One point of each cell of the finest grid that leaves at most `most_points` of a scan, chosen
// without regard to its place in the cell, so that noise is not favoured to one side. Points that
// belong to no surface are left out. Errors are those of CheckScan and AnalyzeScan, with the number
// of the scan, counted from 0, in the payload kScanPayload.
absl::StatusOr<SampledScans> SampleScans(std::span<const PointCloud> scans, int most_points,
                                         const RunContext& context);

inline constexpr char kScanPayload[] = "rilievo/scan";

}  // namespace rilievo
