// A surface scaled to a box, some of its features not.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// What of the surface lies within `radius` of a line, between its ends: a bore with its wall, a
// boss. Scan frame.
struct KeptFeature {
  Eigen::Vector3d from, to;
  double radius = 0;
};

struct ScaledSurface {
  ControlMesh cage;                   // the control points of the scaled surface; scan frame
  Eigen::Vector3d size_before, size;  // of the box of the displaced vertices, scan unit
  int held = 0;                       // control points that moved with a feature
  int rounds = 0;
};

// Constrained scaling (S. Lai, "Subdivision surface based one-piece representation", PhD thesis,
// University of Kentucky 2006, chapter on constrained scaling): the box of the displaced vertices
// of level max_level becomes `size`, about its middle, while all that depends on the control points
// of a feature moves as a whole, to where the scaling takes the middle of its line. All others take
// the least-squares solution of a Ceres Problem: second differences (umbrellas) as near as possible
// to those of the scaled control mesh, and positions near to it with kScaleSurface.position_weight.
// Heights stay. The factors are corrected until the box is met to 1e-10 of the diagonal, since
// heights do not scale and features do not either.
//
// INVALID_ARGUMENT for a size that is not finite and positive, a feature without a length or
// radius, and one that holds no part of the surface; FAILED_PRECONDITION when two features share
// control points, or the features do not let the box become that large or small; CANCELLED; else
// the errors of DisplaceVertices().
absl::StatusOr<ScaledSurface> ScaleSurface(const DisplacedSurface& surface,
                                           const Eigen::Vector3d& size,
                                           const std::vector<KeptFeature>& features,
                                           const RunContext& context);

}  // namespace rilievo
