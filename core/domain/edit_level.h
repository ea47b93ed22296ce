// Multiresolution editing: the vertices of one level are moved, and the finer detail rides along
// (Zorin, Schroeder, Sweldens 1997, "Interactive multiresolution mesh editing"): analysis of the
// edit to control points by least squares, and to heights along the new normals.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// The control mesh of `surface` with points that bring its vertices of `level`, [0, max_level], as
// near to `targets` as its heights allow: least squares over c of sum |S_v(c) + h_v n_v - t_v|^2,
// with normals n of the round before. Column = vertex of the level, unit frame. FAILED_PRECONDITION
// when the vertices do not determine the control points.
absl::StatusOr<ControlMesh> ControlMeshThrough(const DisplacedSurface& surface, int level,
                                               const Eigen::Matrix3Xd& targets,
                                               const RunContext& context);

// What is left between the vertices and their targets, along the surface, where heights cannot
// reach. Unit frame.
struct TargetsMissed {
  double rms = 0, max = 0;
};

// Changes the heights of `surface` so that its vertices of `level` come to `targets` as near as
// along their normals. The changes are interpolated to the finer levels, as Tessellate() does with
// heights, so that detail stays what it is against the level.
absl::StatusOr<TargetsMissed> MoveHeightsTo(const Eigen::Matrix3Xd& targets, int level,
                                            const RunContext& context, DisplacedSurface* surface);

}  // namespace rilievo
