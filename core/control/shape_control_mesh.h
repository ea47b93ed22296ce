// The control mesh of a shape that is there as a fine mesh.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/oriented_cloud.h"
#include "core/points/point_index.h"

namespace rilievo {

// `shape`, an oriented manifold near the points, simplified to about `target_faces`: its bends
// sharpened by the planes of the points beside them, faces shorter where points would be left
// uncovered, creases tagged unless `creases` says no or `shape` has them already. Topology and
// borders stay. `border_weight`: see SimplifyOptions::boundary_weight. `index` holds the points of
// `cloud`; unit frame.
absl::StatusOr<ControlMesh> ShapeControlMesh(ControlMesh shape, const OrientedCloud& cloud,
                                             const PointIndex& index, CreaseRule creases,
                                             int target_faces, double border_weight,
                                             const RunContext& context);

}  // namespace rilievo
