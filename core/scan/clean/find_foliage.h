// Points that fill a volume, as leaves do.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Whether so many points lie in a volume of points near them that FindFoliage() may find any. Takes
// a part of its time, and no normals.
absl::StatusOr<bool> MayHoldFoliage(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                                    const RunContext& context);

// By point, whether it is one of leaves, twigs or clutter that no surface explains; empty: none is.
// A third of the points around it, two rings far, lie off their neighbours by a good part of the
// spacing and by far more than points of the scan usually do, and a hundred of those that hang
// together lie deep in a volume of points. On a surface, at its edges and on the sheets of a thin
// wall too, many neighbours are of the same sheet, so a low quantile of the distances is small.
// Where noise is thicker than a tenth of the spacing all over the scan, or half of it is leaves, no
// leaves can be told. Rods about as thick as the points are apart count as twigs where they fill a
// volume. `cloud`: points, normals of either sign, and spacing. `graph`: of its points, by sheets.
absl::StatusOr<std::vector<uint8_t>> FindFoliage(const OrientedCloud& cloud,
                                                 const NeighborGraph& graph,
                                                 const RunContext& context);

}  // namespace rilievo
