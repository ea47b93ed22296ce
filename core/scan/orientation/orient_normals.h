// Consistent orientation of normals by votes between neighbours, and by the winding number.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct OrientationResult {
  int components = 0;  // of the neighbour graph, before small gaps between them are bridged
  // Share of graph edges whose normals disagree after orientation, in [0, 1]: near 0 on a
  // surface, higher where sheets touch, on a Moebius band or in a volume of points.
  double disagreement = 0;
};

// Flips cloud->normals in place and marks the points whose orientation is ambiguous.
absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, OrientedCloud* cloud,
                                                const RunContext& context);

}  // namespace rilievo
