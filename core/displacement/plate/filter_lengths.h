// How smooth the heights are to be, region by region.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/plate/height_problem.h"

namespace rilievo {

// The finest level on which a vertex has, on average, as many points as a region needs.
int RegionLevel(const HeightProblem& problem);

struct FilterLengths {
  std::vector<float> lengths;  // in spacings, per vertex of the finest level
  double leverage = 1;         // L below, in the mean of the points
};

// The lengths are those of least generalised cross-validation over regions, a vertex of RegionLevel
// and its ring,
//   mean a r^2 / (1 - L)^2, r: residual, L: mean share of a point in its own fitted height,
// smoothed over two rings. L joins, as the root of the sum of squares, what the plate leaves a
// point and what the fit of the domain took: a few degrees of freedom for each control vertex.
absl::StatusOr<FilterLengths> ChooseFilterLengths(const HeightProblem& problem,
                                                  const RunContext& context);

}  // namespace rilievo
