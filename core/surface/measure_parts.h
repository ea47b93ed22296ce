// The error of a surface that is never in memory as a whole.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/part_triangles.h"

namespace rilievo {

// A surface in parts: each of its triangles is in one.
struct SurfaceParts {
  int count = 0;
  // Part i, [0, count), the same each time. For several threads at once.
  std::function<absl::StatusOr<PartTriangles>(int i, const RunContext& context)> triangles;
  double area = 1;  // of them all, about
};

struct PartsError {
  TwoSidedError error;
  int64_t folds = 0;
  std::array<int64_t, 3> source_counts{};  // vertices of each HeightSource
};

// As MeasureAgainst, where the surface is a and b a point set with gaps: about options.samples of
// them are spread evenly over its area, as many more as it has more than `area`. Distances from b
// are exact. INVALID_ARGUMENT where `area` is not above 0. Parts are asked for once, and once more
// where they lie near to what is far from all.
absl::StatusOr<PartsError> MeasureParts(const SurfaceParts& surface, const SearchableShape& b,
                                        const MeasureOptions& options, const RunContext& context);

// Folds and sources alone.
absl::StatusOr<PartsError> CountParts(const SurfaceParts& surface, const RunContext& context);

// As MeasureOneSided.
absl::StatusOr<DistanceSummary> MeasureToParts(const Eigen::Matrix3Xd& points,
                                               const SurfaceParts& surface,
                                               const RunContext& context);

}  // namespace rilievo
