// Where rays meet an analytic shape, by sphere tracing (Hart 1996).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tests/scans/analytic_shape.h"

namespace rilievo {

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  // unit
};

// Parameters t in (0, t_end) at which the ray crosses the surface, ascending, each to rounding;
// at most `limit` of them. Sheets closer than 1e-6 of the diagonal along the ray may be missed.
std::vector<double> RayCrossings(const AnalyticShape& shape, const Ray& ray, double t_end,
                                 int limit);

}  // namespace rilievo
