// The shape that goes in, points or triangles, as points with a control mesh over them.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "core/control/build_control_mesh.h"
#include "core/geometry/point_cloud.h"
#include "core/meshes/check_mesh.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/scan/scan_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// What fit, heights and coding ask for.
struct ShapedInput {
  ScanSurface scan;            // without its neighbour graph
  ControlMeshResult control;   // without its cloud, which is that of the scan
  ReconstructOptions options;  // lengths as fractions of the diagonal
  std::string hash;            // HashOfScan()
  MeshFigures mesh = {};       // of a scan: none
  Shape given_mesh = {};       // unit frame: what errors are measured against; of a scan: none
};

// `spent`: where the memory of `scan` may go once its points have been checked; or null.
absl::StatusOr<ShapedInput> ShapeScan(const PointCloud& scan, PointCloud* spent,
                                      const ReconstructOptions& options,
                                      const PipelineContext& context);

// Both halves of ShapeScan(): the points, checked, without outliers and with their sides; and the
// control mesh over them.
absl::StatusOr<ScanSurface> AnalyzeInput(const PointCloud& scan, PointCloud* spent,
                                         const ReconstructOptions& options,
                                         const PipelineContext& context);
absl::StatusOr<ShapedInput> ShapePoints(ScanSurface surface, std::string hash,
                                        const ReconstructOptions& options,
                                        const PipelineContext& context);

// The same of a mesh: its control mesh is the mesh itself, made even and simplified, so topology
// and borders are the mesh's own, and the points lie all over its triangles. INVALID_ARGUMENT where
// the options ask for another topology, a control mesh or closed borders.
absl::StatusOr<ShapedInput> ShapeMesh(const PointCloud& mesh, PointCloud* spent,
                                      const ReconstructOptions& options,
                                      const PipelineContext& context);

// The points that ShapeScan() works on, made once more to check a surface.
absl::StatusOr<ScanSurface> PointsOfScan(const PointCloud& scan, const ReconstructOptions& options,
                                         const RunContext& context);

}  // namespace rilievo
