// Control meshes of fewer faces for a scan.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/out_of_reach.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

// `start`, as BuildControlMesh() made it of the scan, with about `target_faces` faces. Machined
// parts carry their creases along. What few creases another shape has are found anew in the points
// instead: on faces that long most are bends that need none, and would cost more than they give
// (spot at 0.03 %: 13 % of the bytes). `lost` and errors: those of CoarserControlMesh().
absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context,
                                       const OutOfReach& lost = {});

}  // namespace rilievo
