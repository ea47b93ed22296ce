// Heights that ran away from all points, brought back towards the domain.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"
#include "core/points/point_index.h"

namespace rilievo {

// The domain was fitted to many points, a height to few or, as a fill, to none: the slope of its
// rim may take a fill out of a narrow place, and a ray that slips by an edge meets planes beyond
// it. Where no point is within half a spacing (a spacing, where the sides of an edge told the
// height) and .8 deviations of noise of a place, and the way
// back to the domain comes nearer than .8 of that to one that faces along the limit normal, the
// height is the one that comes nearest; elsewhere, as in a hole, it stays. Measured heights count
// as fitted then. `index` holds the points of `cloud`, `limit` the vertices of `samples`, whose
// heights are finite; unit frame. CANCELLED when stopped.
absl::Status RetractHeights(const OrientedCloud& cloud, const PointIndex& index,
                            const LimitSurface& limit, const RunContext& context,
                            HeightSamples* samples);

}  // namespace rilievo
