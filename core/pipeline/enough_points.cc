#include "core/pipeline/enough_points.h"

#include <utility>

#include "core/base/status_macros.h"
#include "core/meshes/scan_of_mesh.h"

namespace rilievo {
namespace {

// In errors that it may have.
double ErrorOfSurface(const ReconstructReport& report) {
  return report.max_error > 0 ? report.error.across_rms / report.max_error
                              : report.error.rms / kMeshError;
}

}  // namespace

absl::StatusOr<Reconstruction> WithEnoughPoints(
    int64_t triangles, const ReconstructOptions& options,
    const std::function<absl::StatusOr<Reconstruction>(int64_t points)>& run) {
  const int64_t few = FewPointsOnTriangles(triangles), most = PointsOnTriangles(triangles);
  RILIEVO_ASSIGN_OR_RETURN(Reconstruction made, run(few));
  const double error = ErrorOfSurface(made.report);
  if (!options.measure || options.control.target_faces > 0 || options.max_level ||
      options.encode.max_bytes || error <= 1 || most == few) {
    return made;
  }
  RILIEVO_ASSIGN_OR_RETURN(Reconstruction finer, run(most));
  return ErrorOfSurface(finer.report) < error ? std::move(finer) : std::move(made);
}

}  // namespace rilievo
