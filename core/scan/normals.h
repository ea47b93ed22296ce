// Normals, local spacing and noise from the neighbour lists.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/scan/crease_normals.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"
#include "core/scan/separate_sheets.h"

namespace rilievo {

struct EstimatedNormals {
  OrientedCloud cloud;
  std::vector<BentPoint> bent;  // under noise, ascending: by an edge perhaps
};

// Normals are unoriented (see OrientNormals), those of `bent` to be sharpened once they are not.
// `points`: unit frame, the graph's own points. `replaced`: the lists in whose place the graph has
// those of one sheet. Where a scan is clean (see CleanNormal) those points take their normals from
// all around them, which matters at rims.
absl::StatusOr<EstimatedNormals> EstimateNormals(Eigen::Matrix3Xd points,
                                                 const NeighborGraph& graph,
                                                 const ReplacedLists& replaced,
                                                 const RunContext& context);

}  // namespace rilievo
