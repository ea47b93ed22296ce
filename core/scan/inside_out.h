// Parts of a closed surface whose normals point inward though the rest points outward.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/scan/orientation_patches.h"
#include "core/scan/oriented_cloud.h"
#include "core/scan/signed_graph.h"

namespace rilievo {

// Votes between neighbours can hang a limb on its thin neck the wrong way round, or one side of an
// ear. The winding number of the whole scan shows it: it is one half all over a closed surface with
// outward normals, minus one half on a limb that is inside out, one and a half in such a bore
// (orientation by winding numbers; Xu et al. 2023). Groups of patches are turned where winding
// number and votes together say so and the one gains clearly over the area turned. Nothing is
// turned where the scan is too open to tell: where fewer than six tenths of it have about one half.
// `agreements`: links between patches, > 0 where the normals as they are agree with the votes.
absl::Status TurnInsideOut(const OrientationPatches& patches,
                           const std::vector<SignedLink>& agreements, OrientedCloud* cloud,
                           const RunContext& context);

}  // namespace rilievo
