// Uniform refinement of a control mesh: nested topology, positions, limit positions and normals.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

inline constexpr int kMaxLoopLevel = 8;

// Level 0 is the control mesh. Vertices nest: the first levels[l].vertex_count vertices of level
// l + 1 are those of level l, then follows one vertex an edge of level l, in edge order. Face f of
// level l becomes faces 4 f .. 4 f + 3 of level l + 1: corner 0, 1, 2, then the middle one, so the
// faces of one control face stay together at every level. With m_k the new vertex on the edge under
// half-edge k they are (v0, m0, m2), (m0, v1, m1), (m2, m1, v2), (m1, m2, m0). Each level equals
// what BuildMeshTopology makes of its faces.
struct LoopRefinement {
  std::vector<MeshTopology> levels;
  int max_level() const { return static_cast<int>(levels.size()) - 1; }
};

// RESOURCE_EXHAUSTED when the finest level would have more than 2^30 faces.
absl::StatusOr<LoopRefinement> RefineTopology(const ControlMesh& mesh, int max_level,
                                              const RunContext& context);

// One step of Loop subdivision: values at level `level` to values at level + 1. Column = vertex.
Eigen::Matrix3Xd SubdivideOnce(const LoopRefinement& refinement, int level,
                               const Eigen::Matrix3Xd& values);

// Limit positions and unit limit normals of every vertex of one level. A vertex has the same limit
// at every level that holds it. Where the limit tangents span no plane the normal falls back to the
// area-weighted normal of the faces around the vertex at the level that first holds it, and to +z
// if that is zero as well; never NaN for finite control points.
struct LimitSurface {
  Eigen::Matrix3Xd positions;  // column = limit position
  Eigen::Matrix3Xd normals;    // column = unit limit normal
};
absl::StatusOr<LimitSurface> EvaluateLimit(const LoopRefinement& refinement,
                                           const Eigen::Matrix3Xd& control_points, int level,
                                           const RunContext& context);

}  // namespace rilievo
