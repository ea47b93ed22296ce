// The domain surface, a Loop or Catmull-Clark surface, fitted to the points by Ceres or by Suzuki's
// update.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

enum class FitMethod {
  kSuzuki,        // c += lambda (q - S), Suzuki 1999; Jeong and Kim 2002, eq. 2. Fast.
  kLeastSquares,  // robust squared distance with Ceres, started from some of Suzuki's updates
};

struct FitOptions {
  FitMethod method = FitMethod::kLeastSquares;
  int suzuki_rounds = 1;       // [0, 50]
  double suzuki_lambda = 0.8;  // (0, 1], Jeong and Kim 2002, section 4.2
  int rounds = 4;              // of foot points and solve in turn, [1, 50]
  // A control face is sampled at this level's vertices, [0, 4]; at a lower level, but not below 1,
  // where the lower one already gives as many samples as there are points, or the higher one more
  // than 60 000.
  int sample_level = 2;
  // Of the point-to-point part beside point-to-plane, [0, 1]. The less, the farther control points
  // slide to align with features: on mechpart 0.05 gives 1.2 times and 0.003 0.9 times the RMS.
  double tangential_weight = 0.01;
  // Weight of the thin-plate fairness, lowered to `fairness_end` over the rounds. >= 0.
  double fairness_start = 1e-2;
  double fairness_end = 1e-4;
  // Scale of the robust loss, in local spacings. > 0.
  double robust_spacings = 2.0;
  // RMS that whoever asks has use for, unit frame; 0: any. A fit that is far off it after a round
  // of least squares ends there: the first does most of the way. >= 0.
  double wanted_rms = 0;
  absl::Status Validate() const;
};

// Of the progress: what so many rounds of both methods are of all.
inline double ShareOfRounds(const FitOptions& options, int rounds) {
  const int of_ceres = options.method == FitMethod::kLeastSquares ? options.rounds : 0;
  return static_cast<double>(rounds) / (options.suzuki_rounds + of_ceres);
}

struct DomainFit {
  ControlMesh control_mesh;  // same faces and tags as given, control points moved
  // Root mean square distance of the cloud's points to the surface: point to plane at the nearest
  // sample, unit frame.
  double rms_before = 0;
  double rms_after = 0;
  int rounds = 0;                 // of both methods; fewer than asked when one did not help
  bool converged = false;         // the last round moved control points by less than 1e-4
  std::vector<double> round_rms;  // rms after each round
};

// `index` holds the points of `cloud`; `start` lies within about two of its edges of the cloud.
// Samples without data keep their place but for fairness; open control meshes follow the cloud's
// border. INVALID_ARGUMENT for options out of range, or a control mesh that is not a manifold;
// CANCELLED within some milliseconds of a stop request.
absl::StatusOr<DomainFit> FitLoopDomain(const OrientedCloud& cloud, const PointIndex& index,
                                        const ControlMesh& start, const FitOptions& options,
                                        const RunContext& context);

}  // namespace rilievo
