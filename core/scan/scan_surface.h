// The scan stages in order: neighbours, outliers, normals, orientation.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/known_borders.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/clean/remove_outliers.h"
#include "core/scan/orientation/orient_normals.h"

namespace rilievo {

struct ScanOptions {
  NeighborOptions neighbors;
  OutlierOptions outliers;
  SightOptions sights;
  absl::Status Validate() const;
};

struct ScanFigures {
  int64_t non_finite = 0, duplicates = 0, strays = 0;  // as in CheckedScan
  int64_t outliers = 0, island_points = 0;             // as in OutlierResult
  int64_t foliage_points = 0;                          // points that FindFoliage left out
  int64_t kept = 0;                                    // points that are left
  OrientationResult orientation;
};

// Points with their neighbours.
struct ScanNeighbors {
  Eigen::Matrix3Xd points;  // unit frame, in Morton order
  PointSights sights;       // of the points, unit frame
  SpatialFrame frame;       // rounded, as files carry it
  SpatialFrame curve;       // in whose order the points are
  NeighborGraph graph;
  PointIndex index;
  ScanFigures figures;
  std::vector<uint8_t> keep = {};  // see ScanSurface
};

absl::StatusOr<ScanNeighbors> FindNeighbors(CheckedScan scan, const ScanOptions& options,
                                            const RunContext& context);

// By point, whether it is no outlier and no foliage; empty: all are kept.
absl::StatusOr<std::vector<uint8_t>> FindKept(ScanNeighbors scan, const ScanOptions& options,
                                              const RunContext& context);

// The cleaned scan: outliers are gone from the cloud, the graph and the index alike, and the frame
// is the bounding box of what was kept.
struct ScanSurface {
  OrientedCloud cloud;
  std::vector<Rgb> colors;  // of the cloud's points, where they are known
  NeighborGraph graph;      // of many points packed
  PointIndex index;         // of many points over cloud.points
  SpatialFrame frame;
  ScanFigures figures;
  // By point of the checked scan, whether it is in the cloud; empty: all are.
  std::vector<uint8_t> keep = {};
  KnownBorders borders = {};  // of a mesh whose borders are to be met exactly
};

absl::StatusOr<ScanSurface> OrientScan(ScanNeighbors scan, const ScanOptions& options,
                                       const RunContext& context);

// Both.
absl::StatusOr<ScanSurface> AnalyzeScan(CheckedScan scan, const ScanOptions& options,
                                        const RunContext& context);

}  // namespace rilievo
