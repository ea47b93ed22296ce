// Heights moved to where the surface passes points by.
#pragma once

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The height of a vertex brought within what it may be.
using BoundedHeight = absl::FunctionRef<float(int vertex, float height)>;

// A height is where its own ray meets the points. At tips and rims narrower than the vertices are
// apart, and where heights were filled in, the surface may still pass points by. It is brought to
// each that lies farther off than half a spacing, six deviations of noise and a quarter of the
// triangle's longest edge: one after another, in a few sweeps, the heights of the triangle nearest
// to it move along the gradient of its distance as far as brings them nearest.
// Left alone is what is no part of the surface: points four spacings off and more, those that face
// the other way, outliers, which are off the sheet of their neighbours, shells whose points are off
// one and all, what lies beyond the rim, and what the rays run by. Heights that moved count as
// measured, and as fitted. `limit` holds the vertices of `samples`, which are those of the finest
// level, with `rings` around them; `graph`: the neighbours of the cloud's points; unit frame.
// CANCELLED when stopped.
absl::Status FitMissedPoints(const OrientedCloud& cloud, const NeighborGraph& graph,
                             const LoopRefinement& refinement, const LevelRings& rings,
                             const LimitSurface& limit, BoundedHeight bounded,
                             const RunContext& context, HeightSamples* samples);

}  // namespace rilievo
