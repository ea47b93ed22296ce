// Cutting the control mesh away where, after all, the scan has an opening.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Per face of `mesh`, the share of its limit surface that no point supports (see FindSupport).
absl::StatusOr<std::vector<float>> UnmeasuredShares(const ControlMesh& mesh,
                                                    const OrientedCloud& cloud,
                                                    const PointIndex& index,
                                                    const RunContext& context);

// What stays though it has no points, in the unit of the mesh; 0: nothing.
struct FilledParts {
  double rim = 0;  // within the surface, parts with a shorter one
  double gap = 0;  // parts no wider, and at the boundary those of them that join others
};

// `unmeasured`: as UnmeasuredShares() has it for `mesh`. Faces of which that is three quarters are
// an opening at the boundary; within the surface they are one where they are wider than a hole that
// stays filled. What is `filled` on purpose stays. Result: the mesh without the openings, its tags
// and the order of its faces kept, each fan with a vertex of its own; the mesh as it is when there
// are none, or when nothing else would remain.
absl::StatusOr<ControlMesh> TrimUnmeasured(const ControlMesh& mesh,
                                           const std::vector<float>& unmeasured,
                                           const OrientedCloud& cloud, const PointIndex& index,
                                           const FilledParts& filled, const RunContext& context);

}  // namespace rilievo
