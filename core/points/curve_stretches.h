// Stretches of a Morton curve that do not depend on where the scan begins.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

// The Morton codes of points, ascending. `points`: in the order of the curve; `curve`: the frame
// whose unit cube it fills, in the frame of the points. CANCELLED when stopped.
absl::StatusOr<std::vector<uint64_t>> CodesAlong(const Eigen::Matrix3Xd& points,
                                                 const SpatialFrame& curve,
                                                 const RunContext& context);

// Where the stretches end. They are whole cells of the curve's octree. Neighbours that have too few
// places are taken together, so each has at least `least` places, mostly fewer than three times as
// many. Only a curve that is one stretch may have fewer. Places with one code stay together. A part
// of a scan has the stretches of the whole, except in and beside the cells that it cuts.
// `codes`: ascending, at least one.
std::vector<int64_t> StretchEnds(const std::vector<uint64_t>& codes, int64_t least);

}  // namespace rilievo
