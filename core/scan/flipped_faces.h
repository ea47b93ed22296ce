// Small faces of thin parts whose normals point the wrong way though those around them do not.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/scan/orientation_patches.h"
#include "core/scan/oriented_cloud.h"
#include "core/scan/signed_graph.h"

namespace rilievo {

// Along the fold of an ear, a finger or a sheet votes between neighbours can hang one face on the
// other the wrong way round, and the winding number next to it stays near that of a right one.
// The way it falls does not: where normals are right, what the rest of the surface adds to the
// winding number falls along them, on both sides of the fold. Points count as dipoles (Barill et
// al. 2018); two of them agree by as much as the winding number of the one falls along the other,
// and the sum over all pairs is largest where the surface has no rims but its own, closed or open
// (orientation by winding numbers: Xu et al. 2023). From patches with a good part of their votes
// against them on, those that disagree with the rest of the scan are searched, together with all
// around them, for the signs that agree best (Kernighan and Lin 1970), and what surely gains is
// turned; not sets of which much lies in patches of a few points, as on pins. Twice at most,
// nothing where more than 1500 patches hang together so, and on a scan that faces one way, more
// than a hemisphere does, nothing that faces that way too.
// `agreements`: links between patches, > 0 where the present normals agree with them.
absl::Status TurnFlippedFaces(const OrientationPatches& patches,
                              const std::vector<SignedLink>& agreements, OrientedCloud* cloud,
                              const RunContext& context);

}  // namespace rilievo
