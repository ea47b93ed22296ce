// What the fit asks of each sample in one round: where to go, and how firmly in which direction.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/domain/foot_points.h"

namespace rilievo {

// Column = sample.
struct SampleTargets {
  Eigen::Matrix3Xd positions;  // q, unit frame
  // Rows 3 r .. 3 r + 2: direction r times the square root of its weight. Direction 0 is the
  // normal n_q; 1 and 2 are the tangents, of which a sample has all, some or none (row_count).
  Eigen::Matrix<double, 9, Eigen::Dynamic> weighted_directions;
  // 3 at the samples of the control vertices, 2 at others on the boundary, 1 elsewhere; the
  // same in all rounds.
  std::vector<int> row_count;
};

SampleTargets MakeSampleTargets(const DomainSamples& samples);

// Sample i is asked to
// - lie on the plane of its foot point, with weight A_i w_i (area share, robust weight);
// - stay beside its foot point if it is a control vertex's, with `tangential_weight` times the
//   vertex's area share;
// - come to the cloud's border if it is on the boundary.
// Without data it is asked nothing.
absl::Status AimSamples(const DomainSamples& samples, const SampledSurface& surface,
                        const FootPoints& foot_points, const AreaShares& areas,
                        double tangential_weight, const RunContext& context,
                        SampleTargets* targets);

}  // namespace rilievo
