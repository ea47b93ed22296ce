// The error of one part of a surface that is never in memory as a whole.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/nearest_of_parts.h"
#include "core/surface/point_pages.h"

namespace rilievo {

// What one part shows of both ways: a function of the part and the points.
struct MeasuredPart {
  Eigen::Matrix<double, 3, 2> box;  // its least and largest corner
  int64_t folds = 0;
  std::array<int64_t, 3> source_counts{};
  std::vector<double> squared;  // of its samples, from the nearest points
  // Squared too: of its vertices and samples the largest, and the sum across the surface.
  double largest = 0, across_sum = 0;
  int64_t across_count = 0;
  // Of the points in its box, grown by kNearPart: a bit for each point of these pages, page after
  // page, whether it is one, and the squared distances of those that are.
  std::vector<int> pages;
  std::vector<uint8_t> in_reach;
  std::vector<float> squared_of_points;
};

// Of part i. Of its samples there are about as many as its share of options.samples, which are for
// the `area` of the whole. INVALID_ARGUMENT where that is not above 0.
absl::StatusOr<MeasuredPart> MeasurePart(const SurfaceParts& surface, int i,
                                         const MeasureOptions& options, const RunContext& context,
                                         const PointPages& points);

// Brings the distances of the points to their pages, and frees their memory. INTERNAL where the
// numbers are not those of such a part; the errors of `points`.
absl::Status TakeDistances(MeasuredPart* part, PointPages* points);

absl::Status CheckMeasure(const SurfaceParts& surface, const MeasureOptions& options);

}  // namespace rilievo
