// The side of what a scan that was seen from above has nothing over.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

// Where the mean of all normals by area, whose length is 1 for a plane and 1/2 for a hemisphere,
// points up by more than 3/4, the scan was seen from above, as from the air. What hides all that is
// below it, and has nothing above it, was then seen from there too, and faces up: roofs whose
// convex side is below, or that hang over other layers. Patches of which a tenth of the points has
// others above or below are not asked: an underside has its upper side above it or, where it was
// seen from below, what was seen there too. The others vote like given normals. Sets of patches
// that would turn do so where kLeastVotes of the links to others, by weight, would have them
// turned; what nothing links stays. `agreements`: links between patches, > 0 where the present
// normals agree with them. `k`: neighbours of a point.
absl::Status TurnToSky(const OrientationPatches& patches, const std::vector<SignedLink>& agreements,
                       int k, OrientedCloud* cloud, const RunContext& context);

}  // namespace rilievo
