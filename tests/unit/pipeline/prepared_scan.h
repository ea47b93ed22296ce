// A simulated scan as the stages behind the control mesh receive it.
#pragma once

#include "core/control/build_control_mesh.h"
#include "core/pipeline/build_surface.h"
#include "core/scan/clean/check_scan.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {

struct PreparedScan {
  ScanSurface scan;
  ControlMesh control;
  ReconstructReport report;
};

inline PreparedScan PrepareScan(const AnalyticShape& shape, int points, double noise) {
  ScannerOptions scanner;
  scanner.points = points;
  scanner.views = 0;
  scanner.noise = noise;
  const PointCloud cloud = SimulateScan(shape, scanner).value().cloud;
  const RunContext context;
  const CheckedScan checked = CheckScan(cloud, CheckOptions{}, context).value();
  PreparedScan prepared{AnalyzeScan(checked, ScanOptions{}, context).value(), {}, {}};
  ScanSurface& scan = prepared.scan;
  ControlMeshResult result = BuildControlMesh(std::move(scan.cloud), scan.graph, scan.index,
                                              scan.frame, ControlOptions{}, context)
                                 .value();
  scan.cloud = std::move(result.cloud);
  prepared.control = std::move(result.mesh);
  prepared.report.points_used = scan.cloud.points.cols();
  prepared.report.median_spacing = scan.cloud.median_spacing;
  prepared.report.median_noise = scan.cloud.median_noise;
  return prepared;
}

}  // namespace rilievo
