// Input validation: which points of a scan can be used, and the frame all later stages work in.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/spatial_frame.h"
#include "core/scan/clean/settings.h"

namespace rilievo {

struct CheckOptions {
  // Points closer than this to an earlier one are duplicates; fraction of the diagonal. [0, 0.01].
  double duplicate_distance = 1e-9;
  absl::Status Validate() const;
};

// Points outside are strays: absurdly far from nearly all of those at `columns`, finite ones, which
// may be a sample. CANCELLED is the only error.
absl::StatusOr<Eigen::AlignedBox3d> StrayLimit(const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                                               const std::vector<int>& columns,
                                               const RunContext& context);

// A scan whose points are finite, distinct and span at least a plane.
struct CheckedScan {
  Eigen::Matrix3Xd points;  // unit frame, in Morton order (neighbours in space lie close in memory)
  std::vector<int> source_index;  // column of the scan that each point came from
  PointSights sights;             // of these points, unit frame
  SpatialFrame frame;
  SpatialFrame curve;      // in whose order the points are: `frame`, or that of a larger scan
  int64_t non_finite = 0;  // dropped
  int64_t duplicates = 0;  // dropped
  int64_t strays = 0;      // dropped: far points that would own the bounding box (see the .cc)
  bool planar = false;     // all points in one plane
};

// INVALID_ARGUMENT, with the count and what is needed, when fewer than kCheckScan.min_scan_points
// distinct finite points remain, when all are identical or collinear, or when they are too far out
// for the frame of a surface (kMostFrameLength), or when the sights are not those of the points
// (CheckSights). The bounding box (so the frame) is robust: a handful of points that are extremely
// far from all others do not set it. `curve`: of a part of a scan, the frame of the whole.
absl::StatusOr<CheckedScan> CheckScan(const PointCloud& scan, const CheckOptions& options,
                                      const RunContext& context,
                                      const std::optional<SpatialFrame>& curve = std::nullopt);

}  // namespace rilievo
