#include "core/scan/local_shape/measurement_noise.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/points/curve_stretches.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {

absl::StatusOr<std::vector<float>> MeasurementNoise(const Eigen::Matrix3Xd& points,
                                                    const SpatialFrame& curve,
                                                    const std::vector<float>& residuals,
                                                    const RunContext& context) {
  std::vector<float> noise(residuals.size(), std::numeric_limits<float>::max());
  if (noise.empty()) return noise;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint64_t> codes, CodesAlong(points, curve, context));
  for (const NoiseStretch& stretch : kMeasurementNoise.stretches) {
    const std::vector<int64_t> ends = StretchEnds(codes, stretch.points);
    const auto bound_stretch = [&](int64_t s) {
      const int64_t begin = s == 0 ? 0 : ends[s - 1], end = ends[s];
      const double level =
          Quantile(std::vector<float>(residuals.begin() + begin, residuals.begin() + end),
                   kMeasurementNoise.share);
      const auto bound =
          static_cast<float>(stretch.bound * level / kMeasurementNoise.quantile_of_gaussian);
      for (int64_t i = begin; i < end; ++i) noise[i] = std::min(noise[i], bound);
    };
    RILIEVO_RETURN_IF_ERROR(
        ParallelForEach(static_cast<int64_t>(ends.size()), 1, context, bound_stretch));
  }
  return noise;
}

}  // namespace rilievo
