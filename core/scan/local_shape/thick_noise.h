// How far the noise found by the nearest neighbours is from what wider neighbourhoods show.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Where noise is as thick as the spacing, the nearest points of a point are the nearest in height
// too and show too little of it: half of it at twice the spacing. Neighbourhoods gathered along the
// tangent plane do not choose by height. The middle ratio of their noise to the stated one, over a
// few hundred points noisier than a third of their spacing, is the factor, [1, 4], for all such
// points: full from half of the spacing on, none below a third. 1 where few are noisy. Sets
// `median_noise` anew.
absl::Status CorrectThickNoise(const PointIndex& index, const RunContext& context,
                               OrientedCloud* cloud);

}  // namespace rilievo
