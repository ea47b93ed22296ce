// The control mesh of a cloud of any topology.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct ArbitraryMesh {
  ControlMesh mesh;
  OrientedCloud cloud;  // as given, each normal on the side that the implicit function has outside
};

// The iso-surface of an implicit function of the oriented points, trimmed where no point supports
// it and simplified; its creases tagged unless `creases` says no. `graph` and `index` are those of
// the cloud's points.
absl::StatusOr<ArbitraryMesh> ArbitraryControlMesh(OrientedCloud cloud, NeighborGraph graph,
                                                   const PointIndex& index, BoundaryRule boundary,
                                                   CreaseRule creases, int target_faces,
                                                   const RunContext& context);

}  // namespace rilievo
