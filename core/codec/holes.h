// Patches of filled heights.
#pragma once

#include <cstdint>
#include <vector>

#include "core/loop/refinement.h"

namespace rilievo {

// Clears the flags of patches of fewer than `smallest` filled vertices, joined along the edges of
// level `max_level`. `refinement` reaches max(0, max_level - 1).
void DropSmallHoles(const LoopRefinement& refinement, int max_level, int smallest,
                    std::vector<uint8_t>& filled);

}  // namespace rilievo
