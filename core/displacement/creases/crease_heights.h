// Heights beside the creases of noisy scans.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/loop/split_normals.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct CreaseHeight {
  int vertex;
  HeightEstimate estimate;
};

// Noise blurs the normals of points beside an edge over several spacings, and a local fit that
// parts the points by them cuts the edge's flanks off. Two sides that part the points by their
// distances do not (FitTwoPlaneModel): they are fitted once at each vertex in `wanted`, which is on
// a crease of two sides, and tell its height and those of the vertices around it, within 0.4 of the
// reach of the fit, that face as one of them. One height a vertex, ascending; those for which the
// points show no two sides are left out. So are heights that were not measured (`samples`), or
// depart from the measured one by half the noise and more, where the nearest points are off both
// sides in the mean or none is within a spacing. `limit` and `rings` are of the finest level,
// `sectors` of the same. CANCELLED when stopped.
absl::StatusOr<std::vector<CreaseHeight>> HeightsBesideCreases(
    const OrientedCloud& cloud, const PointIndex& index, const LevelRings& rings,
    const LimitSurface& limit, const SharpSectors& sectors, const std::vector<uint8_t>& wanted,
    const HeightSamples& samples, const RunContext& context);

}  // namespace rilievo
