// How close a reconstruction comes to the truth, and what it costs.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "tests/accuracy/subject.h"

namespace rilievo {

struct AccuracyFigures {
  // Distances in % of the diagonal, from places spread evenly over the decoded surface to the
  // truth, and from the part of the truth that was seen to the surface.
  double rms = 0;            // root of the mean of both mean squares
  double hausdorff = 0;      // the larger maximum
  int64_t genus = 0;         // of the surface
  double wrong_normals = 0;  // % of the surface's area that faces away from the truth nearest to it
  // % of the surface's area that lies farther than three local spacings and three deviations of the
  // noise from every point of the scan.
  double false_area = 0;
  int64_t bytes = 0;
  double microseconds = 0;  // of processor time, per point
};

// Reconstructs the scan with the default options.
absl::StatusOr<AccuracyFigures> MeasureAccuracy(const Subject& subject, const RunContext& context);

// The same of `seeds` scans of that surface, from the seed named on: geometric means of distances,
// bytes and times, means of the shares, and the genus that most of them have, of several the least.
absl::StatusOr<AccuracyFigures> MeasureAccuracy(const SubjectName& name, int seeds,
                                                const RunContext& context);

}  // namespace rilievo
