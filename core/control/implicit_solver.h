// One level of the screened Poisson problem: conjugate gradients on a sparse grid.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
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

  // Where a speaker lies, and its spacing, in cells.
  Eigen::Vector3d LatticePoint(size_t speaker) const {
    return (cloud.points.col(speakers.points[speaker]) - origin) / cell;
  }
  double SpacingInCells(size_t speaker) const { return speakers.spacing[speaker] / cell; }
};

class PoissonOperator;

// Conjugate gradients on one level: Solve once, and once more after each Turn.
class PoissonSolver {
 public:
  // What `system` refers to must outlive it. The speakers are not read but here and by Turn: what
  // they take may serve the solution, and be theirs again, the same, later.
  PoissonSolver(const ScreenedPoisson& system, const RunContext& context);
  ~PoissonSolver();
  PoissonSolver(const PoissonSolver&) = delete;
  PoissonSolver& operator=(const PoissonSolver&) = delete;

  // `values`: per node, first guess in, solution out. CANCELLED when stopped. It takes the
  // right-hand side with it.
  absl::Status Solve(std::vector<float>* values);

  // The sides of these points, ascending, have changed: solves from then on as a new solver would,
  // made ready in the time that few of them take. CANCELLED when stopped.
  absl::Status Turn(const std::vector<int>& turned_points);

 private:
  const ScreenedPoisson system_;
  const RunContext& context_;
  std::unique_ptr<PoissonOperator> matrix_;
};

}  // namespace rilievo
