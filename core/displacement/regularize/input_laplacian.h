// The input-dependent Laplacian (Jeong and Kim 2002, section 4.4), along the limit normal.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/level_rings.h"

namespace rilievo {

// The paper's operator is the sum of two forces, (1/m) sum (x_j - x) towards the neighbours and
// (x_nearest - x) towards the input. Here both act on the scalar height: with s the deviation that
// noise has left in a height, d = (1/m) sum (h_j - h) and h_0 the height sampled,
//   h += d s^2 / (s^2 + d^2) / 2 + (h_0 - h) d^2 / (s^2 + d^2) / 2.
// Under noise (|d| ~ s) the neighbours pull; where d stands out of the noise it is detail or an
// edge, and the input wins. With s = 0 nothing moves. Heights not measured take no part. On the rim
// of an open domain the neighbours are the two along the rim, for the mean of all lies inside.
// `rings`: those of `finest`.
absl::Status SmoothHeights(const MeshTopology& finest, const LevelRings& rings, int rounds,
                           const RunContext& context, HeightSamples* samples);

}  // namespace rilievo
