// One level of the screened Poisson problem: conjugate gradients on a sparse grid.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/control/implicit/sparse_grid.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The points that take part in a level, and the spacing of points that sparse, unit frame.
struct ActiveSamples {
  std::vector<int> points;
  std::vector<float> spacing;
};

struct ScreenedPoisson {
  const OrientedCloud& cloud;  // points, and the planes they lie on
  // Of the cloud's points: 1, -1: the normal points to the other side, 0: it is not known to which.
  const std::vector<int8_t>& sides;
  ActiveSamples samples;
  const SparseGrid& grid;
  Eigen::Vector3d origin;  // unit frame, position of node (0, 0, 0)
  double cell;             // unit frame
  double screening;        // dimensionless weight of f(p_i) = 0
  bool border_free;  // true: natural border; false: nodes that miss a neighbour keep their value
  int iterations;    // of the conjugate gradients, at most

  // Where a sample lies, and its spacing, in cells.
  Eigen::Vector3d LatticePoint(size_t sample) const {
    return (cloud.points.col(samples.points[sample]) - origin) / cell;
  }
  double SpacingInCells(size_t sample) const { return samples.spacing[sample] / cell; }
};

// Conjugate gradients on one level. `values`: per node, first guess in, solution out. CANCELLED
// when stopped.
absl::Status SolvePoisson(ScreenedPoisson system, const RunContext& context,
                          std::vector<float>* values);

}  // namespace rilievo
