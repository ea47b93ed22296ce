// Parts of a fitted surface that no point tells of, shaped by circular arcs from their rims.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/oriented_cloud.h"
#include "core/points/point_index.h"

namespace rilievo {

// A surface between two points may be a circular arc where their normals are mirror images across
// the plane between them (Karbacher, Seeger and Haeusler: A non-linear subdivision scheme for
// triangle meshes, 2000). Limits of control vertices that no point lies below or above get the mean
// of the normals around them, and the height over the middle of their neighbours, along that
// normal, that arcs from these have; in turn, until they rest. Those at the rim lie on arcs from
// the points beside them. On a sphere that is exact. Control points there, and a few around, are
// moved so that the limits come to lie so, part by part; where that would make the curvature vary
// more than the fit did, a crease passes, or the boundary is reached, the fit stays. `mesh`: a
// fitted one; unit frame. `index` holds the points of `cloud`. Returns whether something was
// moved; CANCELLED when stopped.
absl::StatusOr<bool> FillByArcs(const OrientedCloud& cloud, const PointIndex& index,
                                const RunContext& context, ControlMesh* mesh);

}  // namespace rilievo
