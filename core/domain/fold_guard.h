// Folds: a fit must not turn the domain surface over itself, or offsets along its normals cross.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"

namespace rilievo {

// One entry a control face: 1 where a triangle of its samples turns away from the limit normal at
// one of its corners by 90 degrees or more. A stop request leaves them half done; the caller asks
// context.CheckStop() after.
std::vector<uint8_t> FindFolds(const DomainSamples& samples, const SampledSurface& surface,
                               const RunContext& context);

// Takes back the moves of the control points from `before` to `*control_points` around those faces
// that were not folded before and are now: by half, again by half, at last wholly. `surface` is
// that of `*control_points`, on entry and on return.
absl::Status UndoFolds(const DomainSamples& samples, const Eigen::Matrix3Xd& before,
                       const std::vector<uint8_t>& folded_before, const RunContext& context,
                       Eigen::Matrix3Xd* control_points, SampledSurface* surface);

}  // namespace rilievo
