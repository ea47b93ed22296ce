// A simulated scan as the stages behind the control mesh receive it.
#pragma once

#include <utility>

#include "core/control/build_control_mesh.h"
#include "core/pipeline/code_surface.h"
#include "core/scan/clean/check_scan.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {

struct PreparedScan {
  ScanSurface scan;
  ControlMeshResult control;
};

inline PreparedScan PrepareScan(const AnalyticShape& shape, int points, double noise,
                                const ControlOptions& options = {}) {
  ScannerOptions scanner;
  scanner.points = points;
  scanner.views = 0;
  scanner.noise = noise;
  CheckedScan checked = CheckScan(SimulateScan(shape, scanner)->cloud, {}, {}).value();
  ScanSurface scan = AnalyzeScan(std::move(checked), {}, {}).value();
  ControlMeshResult control =
      BuildControlMesh(std::move(scan.cloud), scan.graph, scan.index, scan.frame, options, {})
          .value();
  scan.cloud = std::move(control.cloud);
  return {std::move(scan), std::move(control)};
}

// Heights over the domain, coded.
inline absl::StatusOr<CodedSurface> SampleAndCode(const PreparedScan& prepared, Domain domain,
                                                  const ReconstructOptions& options) {
  absl::StatusOr<SampledSurface> sampled =
      SampleHeights(prepared.scan, prepared.control.topology, std::move(domain), options, {});
  if (!sampled.ok()) return sampled.status();
  return CodeSurface(prepared.scan.cloud, {}, *std::move(sampled), {}, options, {});
}

}  // namespace rilievo
