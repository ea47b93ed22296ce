// How fine the implicit function has to be around each point.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/implicit/implicit_function.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The cell each point asks for, unit frame: `cell_spacings` of its spacing, less where a sheet of
// opposite normals lies at its back or before its face, never less than the noise allows. Points
// closer together than the scan is in the mean ask for no more than the mean.
absl::StatusOr<std::vector<float>> SizingField(const OrientedCloud& cloud,
                                               const NeighborGraph& graph, const PointIndex& index,
                                               const ImplicitOptions& options,
                                               const RunContext& context);

}  // namespace rilievo
