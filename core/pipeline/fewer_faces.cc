#include "core/pipeline/fewer_faces.h"

#include "core/base/status_macros.h"
#include "core/control/coarser_control_mesh.h"
#include "core/control/tag_creases.h"
#include "core/pipeline/position_step.h"

namespace rilievo {

absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context,
                                       const OutOfReach& lost) {
  if (start.creases.empty() || IsMachined(start)) {
    return CoarserControlMesh(start, target_faces, context, lost);
  }
  const ControlMesh untagged{start.vertices, start.faces, {}, {}};
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh,
                           CoarserControlMesh(untagged, target_faces, context, lost));
  RILIEVO_RETURN_IF_ERROR(TagCreases(scan.cloud, scan.index, context, &mesh));
  return mesh;
}

}  // namespace rilievo
