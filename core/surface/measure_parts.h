// The error of a surface that is never in memory as a whole.
#pragma once

#include <array>
#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/nearest_of_parts.h"
#include "core/surface/point_pages.h"

namespace rilievo {

struct PartsError {
  TwoSidedError error;
  int64_t folds = 0;
  std::array<int64_t, 3> source_counts{};  // vertices of each HeightSource
};

// As MeasureTwoSided, where the surface is a and b a point set with gaps: about options.samples of
// a are spread evenly over its area, as many more as it has more than `area`. All distances are
// exact, those from b in single precision and their percentiles to 6e-5; beside sharp edges the
// sides of b count up to 1 % of the diagonal away from it. INVALID_ARGUMENT where `area` is not
// above 0. Parts are asked for once, and once more where they lie near to what is far from all.
absl::StatusOr<PartsError> MeasureParts(const SurfaceParts& surface, const MeasureOptions& options,
                                        const RunContext& context, PointPages* points);

// Folds and sources alone.
absl::StatusOr<PartsError> CountParts(const SurfaceParts& surface, const RunContext& context);

// As MeasureOneSided.
absl::StatusOr<DistanceSummary> MeasureToParts(const Eigen::Matrix3Xd& points,
                                               const SurfaceParts& surface,
                                               const RunContext& context);

}  // namespace rilievo
