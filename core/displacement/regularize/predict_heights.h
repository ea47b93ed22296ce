// The heights of a level predicted from those of the one before.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/displacement/rays/height_samples.h"
#include "core/loop/refinement.h"

namespace rilievo {

// The height of the new vertex on `edge` of `coarser` by the butterfly scheme (Dyn, Levin and
// Gregory 1990), exact for cubics on a regular grid. Nothing at the boundary or where one of the
// eight heights it stands on was not measured.
std::optional<float> PredictHeight(const MeshTopology& coarser, int edge,
                                   const HeightSamples& samples);

// Per vertex of `level`, [0, max_level]: 0 where the vertices around it that are new in that level
// came out as predicted, within `deviations` of their expected standard deviations. A smooth
// function departs from what is predicted a sixteenth as far at the next level: there nothing is
// left to measure. 1 elsewhere, and all at level 0.
std::vector<uint8_t> PredictionFailures(const LoopRefinement& refinement, int level,
                                        float deviations, const HeightSamples& samples);

}  // namespace rilievo
