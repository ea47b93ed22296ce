// The measurement noise of a scan, from residuals that edges and thin walls raise.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

// The deviation of the noise around each point: a low quantile of the residuals over a stretch of
// the Morton curve, because those near edges, creases and thin walls measure the shape and not the
// scanner. Where all of a stretch is like that, longer stretches bound it. Stretches are whole
// cells of the curve (StretchEnds), so a part of a scan has those of the whole, except in and
// beside the cells that it cuts.
//
// `points`: in the order of the curve; `curve`: the frame whose unit cube it fills, in the frame of
// the points. `residuals`: of the points, a length of theirs. CANCELLED when stopped.
absl::StatusOr<std::vector<float>> MeasurementNoise(const Eigen::Matrix3Xd& points,
                                                    const SpatialFrame& curve,
                                                    const std::vector<float>& residuals,
                                                    const RunContext& context);

}  // namespace rilievo
