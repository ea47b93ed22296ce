// A control mesh with finer faces where an earlier one lost the shape.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/simplify/uncovered_points.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// SimplifyMesh() with faces about half as long around points that were out of reach of an earlier
// result, three more for each face which that had there, up to `most_faces` in all. So the surface
// is mended from the mesh that still has its shape: where a control face spans two prongs,
// splitting it would leave its parts between them. Without such points as SimplifyMesh(). `planes`:
// of the faces of `fine`, without weights.
absl::StatusOr<ControlMesh> AdaptiveSimplify(const UncoveredPoints& lost, const ControlMesh& fine,
                                             const SimplifyOptions& options, int most_faces,
                                             const RunContext& context, FacePlanes planes = {});

}  // namespace rilievo
