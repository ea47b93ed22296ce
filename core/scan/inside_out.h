// Limbs of a closed surface whose normals point inward though the rest points outward.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/scan/orientation_patches.h"
#include "core/scan/oriented_cloud.h"
#include "core/scan/signed_graph.h"

namespace rilievo {

// Votes between neighbours can hang a limb on its thin neck the wrong way round. The winding number
// of the whole scan shows it: it is one half on a closed surface with outward normals and minus one
// half on a limb that is inside out (orientation by winding numbers; Xu et al. 2023). Patches where
// it is negative, as far as `links` connect them, are turned together if some of them come near
// minus one half, and stay turned if it is near one half then. Nothing is turned where that of most
// of the scan is not near one half: the scan is too open to tell.
absl::Status TurnInsideOut(const OrientationPatches& patches, const std::vector<SignedLink>& links,
                           OrientedCloud* cloud, const RunContext& context);

}  // namespace rilievo
