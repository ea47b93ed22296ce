// Points in patches that surely lie on one sheet, and what the patches say of each other's signs.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

struct OrientationPatches {
  std::vector<int> patch;       // by point
  std::vector<uint8_t> parity;  // by point: 1 when opposite to the first of the patch
  int count = 0;
};

// What is turned after all has this share of the votes on its rim for it at least.
inline constexpr double kLeastVotes = 0.1;

// Joined along the spanning forest of ascending 1 - |relation| (Hoppe et al. 1992, with a better
// weight) as long as patches stay small, so that one wrong edge spoils little. `relations`: see
// EdgeSignVotes.
absl::StatusOr<OrientationPatches> SurePatches(const NeighborGraph& graph,
                                               const std::vector<float>& relations,
                                               const RunContext& context);

// Links between patches whose points are neighbours, with the sum of the votes of the edges from
// the one to the other and of the points that face each other across a wall. Where two patches lie
// on top of each other, farther apart than the noise of their means explains, they are the two
// sides of a wall or of a gap and take opposite signs, whatever their edges say: means of many
// points tell sheets apart that single points do not.
absl::StatusOr<std::vector<SignedLink>> LinksBetween(const OrientationPatches& patches,
                                                     const NeighborGraph& graph,
                                                     const std::vector<float>& relations,
                                                     const OrientedCloud& cloud,
                                                     const RunContext& context);

}  // namespace rilievo
