// The part of a plane that a cloud covers.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"

namespace rilievo {

// A raster over the points' plane; (column, row) = floor((position - origin) / cell).
struct OccupiedArea {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // plane coordinates
  double cell = 0;                                   // plane coordinates
  int columns = 0, rows = 0;
  std::vector<uint8_t> inside;  // row by row
  std::vector<float> depth;     // distance to the border of the area, negative outside

  double area() const;
  // Bilinear between cell centres; the border's value outside the raster.
  double Depth(const Eigen::Vector2d& position) const;
};

// Each point covers a disc of about its own spacing. Gaps and notches narrower than six median
// spacings are closed; of the holes left, those smaller than `smallest_hole` (area) are filled, and
// all of them under BoundaryRule::kClose. Islands stay. `spacing` belongs to the columns of
// `points` (plane coordinates).
absl::StatusOr<OccupiedArea> FindOccupiedArea(const Eigen::Matrix2Xd& points,
                                              const std::vector<float>& spacing,
                                              double median_spacing, double smallest_hole,
                                              BoundaryRule boundary, const RunContext& context);

// Fills the holes smaller than `smallest_hole` (area), and renews the depth.
void FillHoles(double smallest_hole, BoundaryRule boundary, OccupiedArea* area);

}  // namespace rilievo
