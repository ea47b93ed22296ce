// Patches wide enough for the noise of the scan.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/scan/local_shape/patch_moments.h"

namespace rilievo {

// Widens each patch until the standard error of its normal, noise / sqrt(points * variance along
// the plane), is below 0.05 radians, or six times. A round adds up the moments of neighbouring
// patches, so it costs 17 additions a point and no wider search; patches across an edge are left
// out. Where noise is thicker than the spacing the rounds run on every n-th point, whose patches
// still hold all points. Patches of clean scans stay as they are.
// `planes`: those of the patches, before and after.
// `noise`: measurement noise at each point, unit frame; `spacing`: see OrientedCloud.
absl::Status AdaptPatches(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                          const std::vector<float>& noise, const std::vector<float>& spacing,
                          const RunContext& context, std::vector<PatchMoments>* patches,
                          std::vector<PatchPlane>* planes);

}  // namespace rilievo
