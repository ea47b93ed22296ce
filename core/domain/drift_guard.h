// Drifted vertices: a fit must not carry the surface away from the points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// One entry a control vertex: how far its limit lies from the nearest point, less a deviation of
// the noise there, in spacings there; 0 where these are 0. `index` holds the points of `cloud`.
absl::StatusOr<std::vector<float>> GapsToPoints(const OrientedCloud& cloud, const PointIndex& index,
                                                const DomainSamples& samples,
                                                const SampledSurface& surface,
                                                const RunContext& context);

// Takes back the moves of the control points from `before` to `*control_points` whose limits are by
// now more than a spacing off the points and half as far again as at the start (gaps as above).
// Least squares see nothing of a corner that stands out: no point has its foot there. A limit that
// its neighbours carried off may stay off. `surface` is that of `*control_points`, on entry and on
// return.
absl::Status UndoDrift(const DomainSamples& samples, const Eigen::Matrix3Xd& before,
                       const std::vector<float>& gaps_at_start, const std::vector<float>& gaps,
                       const RunContext& context, Eigen::Matrix3Xd* control_points,
                       SampledSurface* surface);

}  // namespace rilievo
