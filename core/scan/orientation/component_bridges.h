// What parts of a scan that are no neighbours of each other still say of their signs.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

// Links between components whose gap is below three spacings (of the coarser side), from all
// their pairs of nearest points: the other wall of a thin shell, a sheet cut off by a shadow. Walls
// are told from the floors of a stair by the points around.
// `component`: by point, in [0, components).
absl::StatusOr<std::vector<SignedLink>> BridgeComponents(const OrientedCloud& cloud,
                                                         const std::vector<int>& component,
                                                         int components, const RunContext& context);

}  // namespace rilievo
