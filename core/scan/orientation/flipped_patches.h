// Small faces of thin parts whose normals point the wrong way though those around them do not.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

// Along the fold of an ear, a finger or a sheet votes between neighbours can hang one face on the
// other the wrong way round, and the winding number next to it stays near that of a right one.
// The way it falls does not: where normals are right, what the rest of the surface adds to the
// winding number falls along them, on both sides of the fold. Points count as dipoles (Barill et
// al. 2018); two of them agree by as much as the winding number of the one falls along the other,
// and the sum over all pairs is largest where the surface has no rims but its own, closed or open
// (orientation by winding numbers: Xu et al. 2023). From patches with a good part of their votes
// against them on, those that disagree with the rest of the scan are searched, together with all
// around them, for the signs that agree best (Kernighan and Lin 1970), and sets that
// surely gain are flipped. Sets most of whose area lies in patches of a few points, as on pins, are
// not. There are at most two rounds, and none where more than 1500 patches are connected so. On a
// scan that faces one way (the mean of its normals is longer than that of a hemisphere), nothing
// that faces the same way is flipped. `agreements`: links between patches, > 0 where the present
// normals agree with them.
absl::Status FlipInvertedPatches(const OrientationPatches& patches,
                                 const std::vector<SignedLink>& agreements, OrientedCloud* cloud,
                                 const RunContext& context);

}  // namespace rilievo
