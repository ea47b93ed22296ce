#include "core/control/simplify/coarser_control_mesh.h"

#include <algorithm>

#include "core/base/status_macros.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/settings.h"
#include "core/control/simplify/simplify_mesh.h"

namespace rilievo {

absl::StatusOr<ControlMesh> CoarserControlMesh(const ControlMesh& mesh, int target_faces,
                                               const RunContext& context) {
  const SimplifyOptions simplify{.target_faces = std::max(target_faces, 4),
                                 .evenness = kCoarserControlMesh.evenness};
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh coarser, SimplifyMesh(mesh, simplify, context));
  ImproveShape(&coarser);
  return coarser;
}

}  // namespace rilievo
