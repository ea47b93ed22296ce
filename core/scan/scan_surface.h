// The scan stages in order: neighbours, outliers, normals, orientation.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/clean/remove_outliers.h"
#include "core/scan/orientation/orient_normals.h"

namespace rilievo {

struct ScanOptions {
  NeighborOptions neighbors;
  OutlierOptions outliers;
  absl::Status Validate() const;
};

// The cleaned scan: outliers are gone from the cloud, the graph and the index alike, and the
// frame is the bounding box of what was kept.
struct ScanSurface {
  OrientedCloud cloud;
  NeighborGraph graph;  // of many points packed
  PointIndex index;     // of many points over cloud.points
  SpatialFrame frame;
  int64_t outliers = 0;
  int64_t island_points = 0;
  OrientationResult orientation;
};

absl::StatusOr<ScanSurface> AnalyzeScan(CheckedScan scan, const ScanOptions& options,
                                        const RunContext& context);

}  // namespace rilievo
