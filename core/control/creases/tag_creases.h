// Creases of a control mesh: edges along which the points lie on two sides.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Tags the edges of `*mesh` that follow sharp edges of the scan, and moves the ends of tagged edges
// onto the meeting of the sides (least squares of their distances, Garland and Heckbert 1997). An
// edge is sharp where two sides, planes that may be curved along it, explain the points around it
// better than any quadric does, by what the noise leaves open, and meet along it at 30 degrees or
// more. `index` holds the points of `cloud`. A scan without sharp edges keeps its mesh untouched.
// INVALID_ARGUMENT for a mesh that is not a manifold; CANCELLED after a stop request.
absl::Status TagCreases(const OrientedCloud& cloud, const PointIndex& index,
                        const RunContext& context, ControlMesh* mesh);

}  // namespace rilievo
