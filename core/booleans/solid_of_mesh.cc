#include "core/booleans/solid_of_mesh.h"

#include <utility>

#include "core/base/status_macros.h"
#include "core/meshes/check_mesh.h"

namespace rilievo {

absl::StatusOr<TriangleMesh> SolidOfMesh(const PointCloud& mesh, const RunContext& context) {
  RunContext silent = context;
  silent.progress = nullptr;  // no stage of a reconstruction
  RILIEVO_ASSIGN_OR_RETURN(CheckedMesh checked, CheckMesh(mesh, silent, OppositeTriangles::kNone));
  TriangleMesh solid{std::move(checked.vertices), std::move(checked.triangles), {}};
  for (Eigen::Index v = 0; v < solid.vertices.cols(); ++v) {
    const Eigen::Vector3d given = mesh.points.col(checked.source_vertex[static_cast<size_t>(v)]);
    const bool stayed = checked.frame.UnitFromScan(given) == solid.vertices.col(v);
    solid.vertices.col(v) = stayed ? given : checked.frame.ScanFromUnit(solid.vertices.col(v));
  }
  return solid;
}

}  // namespace rilievo
