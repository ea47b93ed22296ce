// Heights along the limit normals from the unorganized points (seed 004, 4.3 and 4.4).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"
#include "core/surface/height_source.h"

namespace rilievo {

struct DisplacementOptions {
  // Largest |height| kept, fraction of the diagonal. (0, 0.5].
  double max_height = 0.05;
  // A point takes part only if its normal and the ray agree: n_point . n_ray > this. [-1, 1).
  double min_normal_agreement = 0.2;
  // Points pulled into a vertex's queue before it is given up. [3, 256].
  int max_queue = 24;
  // Longest edge of a virtual triangle, in local spacings. > 1.
  double max_triangle_spacings = 4.0;
  // Above this ratio of local noise to local spacing a local fit replaces the bare triangle; from a
  // third of it on, improves it. >= 0.
  double plane_noise_ratio = 0.15;
  // Rounds of the input-dependent Laplacian (4.4), along the normal. [0, 20].
  int smoothing_rounds = 2;
  absl::Status Validate() const;
};

struct DisplacementField {
  std::vector<float> heights;        // per vertex of the finest level, unit frame
  std::vector<HeightSource> source;  // same
  int64_t measured = 0, smoothed = 0, filled = 0;
};

// `rings`, `limit`: of the finest level of `refinement`, of which, unless it is the only one,
// neither faces nor edges are asked for.
absl::StatusOr<DisplacementField> SampleDisplacement(
    const OrientedCloud& cloud, const NeighborGraph& graph, const PointIndex& index,
    const LoopRefinement& refinement, const LevelRings& rings, const LimitSurface& limit,
    const DisplacementOptions& options, const RunContext& context);

}  // namespace rilievo
