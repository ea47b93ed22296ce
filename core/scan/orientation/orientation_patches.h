// Points in patches that surely lie on one sheet, and what the patches say of each other's signs.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/local_shape/separate_sheets.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

struct OrientationPatches {
  std::vector<int> patch;       // by point
  std::vector<uint8_t> parity;  // by point: 1 when opposite to the first of the patch
  int count = 0;
};

// Joined along the spanning forest of ascending 1 - |relation| (Hoppe et al. 1992, with a better
// weight) as long as patches stay small, so that one wrong edge spoils little. `relations`: see
// EdgeSignVotes.
absl::StatusOr<OrientationPatches> SurePatches(const NeighborGraph& graph,
                                               const std::vector<float>& relations,
                                               const RunContext& context);

// Links between patches whose points are neighbours, of one sheet or as they were before the sheets
// were separated, with the sum of the votes of the edges from the one to the other. Where one patch
// lies over the other, as the sides of a wall or of a gap do, what they say of each other as
// dipoles, in spacings, counts as much as all neighbours of a point (see Agreement; dipoles of
// patches: Metzer et al. 2021).
absl::StatusOr<std::vector<SignedLink>> LinksBetween(
    const OrientationPatches& patches, const NeighborGraph& graph, const ReplacedLists& replaced,
    const std::vector<float>& relations, const OrientedCloud& cloud, const RunContext& context);

}  // namespace rilievo
