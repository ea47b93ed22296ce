// Folds: a fit must not turn the domain surface over itself, or offsets along its normals cross.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"

namespace rilievo {

// One entry a control face: the area, unit frame, of the triangles of its samples, and of those
// that turn away from the limit normal at one of their corners by 90 degrees or more.
struct FoldedAreas {
  std::vector<double> whole, folded;
};

// A stop request leaves them half done; the caller asks context.CheckStop() after.
FoldedAreas FindFolds(const DomainSamples& samples, const SampledSurface& surface,
                      const RunContext& context);

// Takes back the moves of the control points from `before` to `*control_points` around those faces
// that were not folded before and are now, and around old folds that the move made half as large
// again and larger than a tenth of their face: by half, again by half, at last wholly.
// `surface` is that of `*control_points`, on entry and on return.
absl::Status UndoFolds(const DomainSamples& samples, const Eigen::Matrix3Xd& before,
                       const FoldedAreas& folds_before, const RunContext& context,
                       Eigen::Matrix3Xd* control_points, SampledSurface* surface);

}  // namespace rilievo
