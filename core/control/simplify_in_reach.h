// A control mesh whose surface can be displaced onto the points.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/simplify_mesh.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// SimplifyMesh(); and where points of `cloud` are out of reach of the result (out_of_reach.h), once
// more from `fine` with faces about half as long around them, three more for each control face
// there. So the surface is mended from the mesh that still has its shape: where a control face
// spans two prongs, splitting it would leave its parts between them. `planes`: of the faces of
// `fine`, without weights. The errors of both.
absl::StatusOr<ControlMesh> SimplifyInReach(const ControlMesh& fine, const SimplifyOptions& options,
                                            const OrientedCloud& cloud, const RunContext& context,
                                            FacePlanes planes);

}  // namespace rilievo
