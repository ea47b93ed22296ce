// The control mesh of a cloud of any topology.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// An implicit function of the oriented points, its iso-surface, trimmed where no
// point supports it, simplified; its creases tagged unless `creases` says no. The cloud's normals
// take the sides that the function found.
absl::StatusOr<ControlMesh> ArbitraryControlMesh(const NeighborGraph& graph,
                                                 const PointIndex& index, BoundaryRule boundary,
                                                 int target_faces, const RunContext& context,
                                                 OrientedCloud* cloud,
                                                 CreaseRule creases = CreaseRule::kAuto);

}  // namespace rilievo
