// A displaced surface as bicubic patches, for CAD.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct BicubicOptions {
  // Largest distance between patches and surface at the same parameter, a fraction of the diagonal.
  // (0, 1).
  double tolerance = 5e-4;
  // Of all patches: by default some 3 GB for what writes them.
  int64_t most_control_points = 10'000'000;
  absl::Status Validate() const;
};

// Curves and patches are cubic B-splines on [0, 1] with equal spans, a power of two of them, and
// knots of multiplicity 4 at the ends (cubic_spline.h). Scan frame.
struct BicubicShell {
  struct Edge {
    int from = 0, to = 0;      // vertices, where the curve begins and ends
    Eigen::Matrix3Xd control;  // column = control point, spans + 3 of them
  };
  // Counter-clockwise seen from outside: corners 0 to 3 lie at (s, t) = (0, 0), (1, 0), (1, 1) and
  // (0, 1), and edge i joins corner i and the one after. Along it the patch is the edge's curve.
  struct Patch {
    std::array<int, 4> edges{};
    std::array<bool, 4> forward{};  // whether the edge runs from corner i to the one after
    std::array<int, 2> spans{};     // along s and t
    Eigen::Matrix3Xd control;       // column = control point, i + (spans[0] + 3) j
  };
  Eigen::Matrix3Xd vertices;  // column = position
  std::vector<Edge> edges;    // each of one patch or of two
  std::vector<Patch> patches;
  double error = 0;  // largest distance found, a fraction of the diagonal
};

inline constexpr int64_t kMostBicubicPatches = 200'000;

// The patches of patch_domains.h: those of a quad of the control mesh, three for a triangle.
// Samples are places of DisplacedEvaluator, four along a side for each triangle of the finest level
// and for each span, twelve at least. Each edge is a least-squares fit to its samples, with as many
// spans as a quarter of the tolerance asks for; each patch is one with its edges held, whose spans
// are halved until it is within the tolerance. So patches share edges exactly; tangent planes agree
// as well as the tolerance makes them. Where 128 spans along a side are too few, `error` exceeds
// the tolerance.
//
// Errors as DisplacedEvaluator::Build(); RESOURCE_EXHAUSTED beyond kMostBicubicPatches and
// options.most_control_points; CANCELLED.
absl::StatusOr<BicubicShell> FitBicubicShell(const DisplacedSurface& surface,
                                             const BicubicOptions& options,
                                             const RunContext& context);

}  // namespace rilievo
