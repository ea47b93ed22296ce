// One level of the screened Poisson problem: conjugate gradients on a sparse grid.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/control/implicit_grid.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// Points that speak at a level, and the spacing of as many of them, unit frame.
struct Speakers {
  std::vector<int> points;
  std::vector<float> spacing;
};

struct ScreenedPoisson {
  const OrientedCloud& cloud;  // points, and the planes they lie on
  // Of the cloud's points: 1, -1: the normal points to the other side, 0: it is not known to which.
  const std::vector<int8_t>& sides;
  const Speakers& speakers;
  const ImplicitGrid& grid;
  Eigen::Vector3d origin;  // unit frame, position of node (0, 0, 0)
  double cell;             // unit frame
  double screening;        // dimensionless weight of f(p_i) = 0
  bool border_free;  // true: natural border; false: nodes that miss a neighbour keep their value
  int iterations;    // of the conjugate gradients, at most
};

// `values`: per node, first guess in, solution out.
absl::Status SolveScreenedPoisson(const ScreenedPoisson& system, const RunContext& context,
                                  std::vector<float>* values);

}  // namespace rilievo
