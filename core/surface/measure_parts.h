// The error of a surface that is never in memory as a whole.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/measure_part.h"
#include "core/surface/nearest_of_parts.h"
#include "core/surface/point_pages.h"

namespace rilievo {

struct PartsError {
  TwoSidedError error;
  int64_t folds = 0;
  std::array<int64_t, 3> source_counts{};  // vertices of each HeightSource
};

// As MeasureTwoSided, where the surface is a and b a point set with gaps. All distances are exact,
// those from b in single precision and their percentiles to 6e-5; beside sharp edges the sides of b
// count up to 1 % of the diagonal away from it. `parts`: all of them, measured with the distances
// of `points` forgotten before, and taken. They are asked for once more where they lie near to what
// is far from all. The errors of MeasurePart().
absl::StatusOr<PartsError> SumOfParts(const SurfaceParts& surface,
                                      const std::vector<MeasuredPart>& parts,
                                      const RunContext& context, PointPages* points);

// Folds and sources alone.
absl::StatusOr<PartsError> CountParts(const SurfaceParts& surface, const RunContext& context);

// As MeasureOneSided.
absl::StatusOr<DistanceSummary> MeasureToParts(const Eigen::Matrix3Xd& points,
                                               const SurfaceParts& surface,
                                               const RunContext& context);

}  // namespace rilievo
