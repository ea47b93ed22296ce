// Heights where there is no data: a thin plate through the heights around the hole.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Sets heights[v] wherever known[v] == 0, v over the vertices of the finest level, to the minimum
// of
//   sum |L h|^2 + a sum |h_i - h_j|^2 + b sum h^2   (L: mean of the neighbours minus the vertex,
// on a rim of the two along it)
// so that the fill continues value and slope of its rim (thin plate), lets the slope go within
// about one control edge (membrane), and returns to the domain surface over some six control
// edges, for what lies far from all data is best told by the domain. Solved by conjugate gradients
// level by level, coarse to fine (cascadic multigrid): the vertices nest. With nothing known all
// heights become 0. Heights known stay as they are.
absl::Status FillHeights(const LoopRefinement& refinement, const std::vector<uint8_t>& known,
                         const RunContext& context, std::vector<float>* heights);

}  // namespace rilievo
