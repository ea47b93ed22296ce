// Cutting the control mesh away where, after all, the scan has an opening.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct TrimUnmeasuredOptions {
  // A control face is unmeasured when at least this share of its heights has no data. (0, 1].
  double unmeasured_share = 0.75;
  // Unmeasured faces inside the surface are a hole to be kept filled when together they are at most
  // this wide, in spacings of the points around; wider ones, and those at the boundary, are
  // openings.
  double filled_hole_spacings = 10;
  // Those with a rim that is shorter than this, in the unit of the mesh, are kept too. >= 0.
  double filled_rim = 0;
  // Where faces are cut, pieces of fewer faces than this that are mostly unmeasured are dropped.
  int min_piece_faces = 8;
};

// `unmeasured`: per face of `mesh`, the share of its heights without data. Result: the mesh without
// the openings, its tags and the order of its faces kept, each fan with a vertex of its own; the
// mesh as it is when there are none, or when nothing else would remain.
absl::StatusOr<ControlMesh> TrimUnmeasured(const ControlMesh& mesh,
                                           const std::vector<float>& unmeasured,
                                           const OrientedCloud& cloud, const PointIndex& index,
                                           const TrimUnmeasuredOptions& options,
                                           const RunContext& context);

}  // namespace rilievo
