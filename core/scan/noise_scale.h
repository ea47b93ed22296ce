// How far the noise found by the nearest neighbours is from what wider neighbourhoods show.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// The factor by which to multiply every noise of an oriented cloud, [1, 4]. Where noise is as thick
// as the spacing, the nearest points of a point are the nearest in height too and show too little
// of it: half of it at twice the spacing. Neighbourhoods gathered along the tangent plane do not
// choose by height; the factor is the middle ratio of their noise to the stated one, over a few
// hundred points noisier than a third of their spacing. 1 where few are.
absl::StatusOr<double> NoiseScale(const OrientedCloud& cloud, const PointIndex& index,
                                  const RunContext& context);

}  // namespace rilievo
