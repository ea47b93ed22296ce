// Patches of filled heights, and of smoothed ones.
#pragma once

#include <cstdint>
#include <vector>

#include "core/loop/refinement.h"

namespace rilievo {

// Clears the flags of patches of fewer than `smallest` filled vertices, joined along the edges of
// level `max_level`. `refinement` reaches max(0, max_level - 1).
void DropSmallHoles(const LoopRefinement& refinement, int max_level, int smallest,
                    std::vector<uint8_t>& filled);

// Of each vertex of level `max_level`, how many of its edges lead to the nearest one that is not
// filled: 0 there, most + 1 for all that are farther than `most`.
std::vector<uint8_t> RingsIntoHoles(const LoopRefinement& refinement, int max_level, int most,
                                    const std::vector<uint8_t>& filled);

// Of the flags of smoothed heights, those of filled ones 0: patches of fewer than `smallest`
// vertices, smoothed or measured, take on the flag around them.
void DropSmallPatches(const LoopRefinement& refinement, int max_level, int smallest,
                      const std::vector<uint8_t>& filled, std::vector<uint8_t>& smoothed);

}  // namespace rilievo
