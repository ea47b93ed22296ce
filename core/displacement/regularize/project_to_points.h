// Heights brought back to where the points are.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/loop/refinement.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// A place on the surface lies amid the eight points nearest to it: even on a sharp edge their mean
// is half a spacing off, on the corner of a box .8 (heights of creases may be 1.2 off), and noise
// moves it by a third of its deviation. Heights that were fitted or filled in and lie farther off
// along their normal, by a plane taken on where the surface turns away or by a fill that ran on
// from its rim, are moved level with the mean; filled ones where points surround the place, for
// within a hole the mean is that of a rim. Only where the noise is over `least_noise` spacings:
// heights of thinner noise follow the points. Under any noise a fill that strays from the points
// farther than the domain does comes back towards it. `index` holds the points of `cloud`, `limit`
// the vertices of `samples`; unit frame.
absl::Status ProjectToPoints(const OrientedCloud& cloud, const PointIndex& index,
                             const LimitSurface& limit, double least_noise,
                             const RunContext& context, HeightSamples* samples);

}  // namespace rilievo
