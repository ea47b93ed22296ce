// One level of the screened Poisson problem: conjugate gradients on a sparse grid.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/control/implicit_grid.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

struct ScreenedPoisson {
  const OrientedCloud& cloud;       // points and spacing
  const Eigen::Matrix3Xd& normals;  // of the cloud's points, as this level believes them
  const std::vector<int>& members;  // points that speak at this level
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
