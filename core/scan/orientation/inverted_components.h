// Limbs and bores of a closed surface whose normals point inward though the rest points outward.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

// Votes between neighbours can hang a limb on its thin neck the wrong way round, and a bore on the
// thin wall beside it. The winding number of the whole scan shows it: what it is on most of the
// scan, one half on a clean closed surface with outward normals, it is less by one on a limb that
// is inside out, and more by one on the wall of a bore that is, for that bounds a pin within the
// solid (orientation by winding numbers; Xu et al. 2023). Patches that are off by a half or more,
// to one side, are parts as far as `links` connect them. Parts that are off by nearly one in the
// mean are turned, and stay so if they are no longer off then; so is what lies within another
// solid, which the number cannot tell from a pin. Nothing is turned where the winding number is
// near zero or less on two fifths of the scan, which is too open to tell.
absl::Status FlipInvertedComponents(const OrientationPatches& patches,
                                    const std::vector<SignedLink>& links, OrientedCloud* cloud,
                                    const RunContext& context);

}  // namespace rilievo
