// Normals, local spacing and noise from the neighbour lists.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/local_shape/separate_sheets.h"
#include "core/scan/local_shape/sharpen_normals.h"

namespace rilievo {

struct EstimatedNormals {
  OrientedCloud cloud;
  std::vector<NearEdgePoint> near_edge;  // under noise, ascending: by an edge perhaps
};

// Normals are unoriented (see OrientNormals), those of `near_edge` to be sharpened once they are
// not. `points`: unit frame, the graph's own points. `curve`: see MeasurementNoise. `replaced`: the
// lists in whose place the graph has those of one sheet. Where a scan is clean (see RobustNormal)
// those points take their normals from all around them, which matters at rims.
absl::StatusOr<EstimatedNormals> EstimateNormals(Eigen::Matrix3Xd points,
                                                 const NeighborGraph& graph,
                                                 const ReplacedLists& replaced,
                                                 const SpatialFrame& curve,
                                                 const RunContext& context);

}  // namespace rilievo
