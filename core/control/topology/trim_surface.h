// Cutting away what no point supports, and mending what the cutting leaves.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct TrimOptions {
  // A vertex is supported when a point whose normal agrees lies within this many of the point's
  // spacings (or four times its noise). (0, 10].
  double support_spacings = 1.6;
  // An unsupported region inside the surface is a hole to be kept filled when its diameter is at
  // most this many spacings; larger ones are openings of the scan and are cut out. >= 0.
  double filled_hole_spacings = 10;
  // Pieces whose supported area, in squared spacings, is less are dropped, but for the largest
  // of four points or more: what wrong normals leave between two sheets is a bubble a few spacings
  // wide. >= 0.
  double min_piece_points = 25;
};

// `surface`: an orientable 2-manifold, all of its vertices used (see SplitFans).
// Result: an orientable 2-manifold, possibly with boundary, possibly of several components.
// With BoundaryRule::kClose only small pieces are dropped and nothing is cut.
absl::StatusOr<ControlMesh> TrimSurface(const ControlMesh& surface, const OrientedCloud& cloud,
                                        const PointIndex& index, BoundaryRule boundary,
                                        const TrimOptions& options, const RunContext& context);

}  // namespace rilievo
