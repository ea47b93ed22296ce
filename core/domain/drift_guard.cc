#include "core/domain/drift_guard.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"

namespace rilievo {

absl::StatusOr<std::vector<float>> GapsToPoints(const OrientedCloud& cloud, const PointIndex& index,
                                                const DomainSamples& samples,
                                                const SampledSurface& surface,
                                                const RunContext& context) {
  const auto count = static_cast<int64_t>(samples.control_vertex_count());
  std::vector<float> gaps(static_cast<size_t>(count));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kHeavyBlock, context, [&](int64_t v) {
    int nearest = 0;
    double squared = 0;
    index.Nearest(surface.positions.col(v), 1, &nearest, &squared);
    const float gap = static_cast<float>(std::sqrt(squared)) - cloud.noise[nearest];
    const float spacing = cloud.spacing[nearest];
    gaps[v] = spacing > 0 ? gap / spacing : 0.0f;
  }));
  return gaps;
}

absl::Status UndoDrift(const DomainSamples& samples, const Eigen::Matrix3Xd& before,
                       const std::vector<float>& gaps_at_start, const std::vector<float>& gaps,
                       const RunContext& context, Eigen::Matrix3Xd* control_points,
                       SampledSurface* surface) {
  if (IsLeftOut(Mechanism::kDriftGuard)) return absl::OkStatus();
  bool any = false;
  for (size_t v = 0; v < gaps.size(); ++v) {
    const float start = gaps_at_start[v];
    if (!(gaps[v] > std::max(kDriftGuard.by_points, kDriftGuard.times * start))) continue;
    control_points->col(v) = before.col(v);
    any = true;
  }
  return any ? SampleSurface(samples, *control_points, context, surface) : absl::OkStatus();
}

}  // namespace rilievo
