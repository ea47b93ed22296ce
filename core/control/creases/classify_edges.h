// Whether the edges of a mesh are sharp or smooth, by the points around them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/edge_model/two_plane_model.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

enum class EdgeClass : uint8_t { kSmooth, kWeak, kStrong };

struct EdgeClassification {
  EdgeClass edge_class = EdgeClass::kSmooth;
  std::optional<TwoPlaneModel> planes;
};

// One judgement an edge. Edges whose faces meet nearly flat, and those of the boundary, are smooth
// unseen. CANCELLED when stopped.
absl::StatusOr<std::vector<EdgeClassification>> ClassifyEdges(const OrientedCloud& cloud,
                                                              const PointIndex& index,
                                                              const ControlMesh& mesh,
                                                              const MeshTopology& topology,
                                                              const RunContext& context);

}  // namespace rilievo
