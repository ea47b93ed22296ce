// The domain surface: a Loop surface fitted to the points, by Ceres or by Suzuki's update.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

enum class FitMethod {
  kSuzuki,        // c += lambda (q - S), Suzuki 1999; seed 004 eq. 2. Fast.
  kLeastSquares,  // robust squared distance with Ceres, started from a few of Suzuki's updates
};

struct FitOptions {
  FitMethod method = FitMethod::kLeastSquares;
  int suzuki_rounds = 1;            // [0, 50]
  double suzuki_lambda = 0.8;       // (0, 1], seed 004 section 4.2
  int rounds = 4;                   // foot points and solves in turn, [1, 50]
  int sample_level = 2;             // a control face is sampled at this level's vertices, [0, 4]
  double tangential_weight = 0.01;  // of the point-to-point part beside point-to-plane, [0, 1]
  // Weight of the thin-plate fairness, lowered to `fairness_end` over the rounds. >= 0.
  double fairness_start = 1e-2;
  double fairness_end = 1e-4;
  // Scale of the robust loss, in local spacings. > 0.
  double robust_spacings = 2.0;
  absl::Status Validate() const;
};

struct DomainFit {
  ControlMesh control_mesh;  // same faces as given, control points moved
  double rms_before = 0;     // distance of the cloud's points to the limit surface samples,
  double rms_after = 0;      // point-to-plane, unit frame
  int rounds = 0;
  bool converged = false;         // the last round moved control points by less than 1e-4
  std::vector<double> round_rms;  // one a round
};

absl::StatusOr<DomainFit> FitLoopDomain(const OrientedCloud& cloud, const PointIndex& index,
                                        const ControlMesh& start, const FitOptions& options,
                                        const RunContext& context);

}  // namespace rilievo
