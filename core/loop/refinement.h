// Uniform refinement of a control mesh: nested topology, positions, limit positions and normals.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/quad_topology.h"
#include "core/loop/sharp_refinement.h"

namespace rilievo {

inline constexpr int kMaxLoopLevel = 8;
inline constexpr int64_t kMaxLoopFaces = int64_t{1} << 30;  // of the finest level

// Level 0 is the control mesh. Vertices nest: the first levels[l].vertex_count vertices of level
// l + 1 are those of level l, then follows one vertex an edge of level l, in edge order. Face f of
// level l becomes faces 4 f .. 4 f + 3 of level l + 1: corner 0, 1, 2, then the middle one, so the
// faces of one control face stay together at every level. With m_k the new vertex on the edge under
// half-edge k they are (v0, m0, m2), (m0, v1, m1), (m2, m1, v2), (m1, m2, m0). Each level equals
// what BuildMeshTopology makes of its faces, but where the finest was added by VerticesAfter: then
// it has vertices alone, and `sharp` says nothing of it.
struct LoopRefinement {
  std::vector<MeshTopology> levels;
  QuadRefinement quads;   // of a Catmull-Clark surface; empty for a Loop surface
  SharpRefinement sharp;  // what creases and corners change; empty for a smooth mesh
  int max_level() const { return static_cast<int>(levels.size()) - 1; }
  // Vertices of level 0 to max_level() + 1: the next level's are known from the last one's edges.
  int vertex_count(int level) const {
    return level <= max_level() ? levels[level].vertex_count
                                : levels.back().vertex_count + levels.back().edge_count();
  }
};

// INVALID_ARGUMENT for faces that BuildMeshTopology, tags that BuildCreaseTopology or diagonals
// that RefineQuads refuses, RESOURCE_EXHAUSTED when the finest level would have more than
// kMaxLoopFaces.
absl::StatusOr<LoopRefinement> RefineTopology(const ControlMesh& mesh, int max_level,
                                              const RunContext& context);

// The vertices of the level after `topology` alone: their number, valence and place on the
// boundary.
MeshTopology VerticesAfter(const MeshTopology& topology);

// All levels, of the finest, unless it is the control mesh, the vertices alone: its faces follow
// from the level before, and values on its vertices ask for no more. Errors: RefineTopology().
absl::StatusOr<LoopRefinement> RefineToVertices(const ControlMesh& mesh, int level,
                                                const RunContext& context);

// The faces of the level after `topology` alone, without edges and adjacency: the lean way to the
// finest level's triangles.
Eigen::Matrix3Xi RefineFaces(const MeshTopology& topology);

// The faces of the finest level, whether or not it was added by VerticesAfter.
Eigen::Matrix3Xi FinestFaces(const LoopRefinement& refinement);

// One step of subdivision, Loop's or Catmull and Clark's: values at level `level` to values at
// level + 1. Column = vertex.
Eigen::Matrix3Xd SubdivideOnce(const LoopRefinement& refinement, int level,
                               const Eigen::Matrix3Xd& values);

// Limit positions and unit limit normals of every vertex of one level, 0 to max_level() + 1: only
// the topology of coarser levels is looked at. A vertex has the same limit at every level that
// holds it. Where the limit tangents span no plane the normal falls back to the area-weighted
// normal of the faces around the vertex at the level that first holds it, and to +z if that is zero
// as well; never NaN for finite control points.
//
// On a crease and at a corner the surface has a normal on each side (crease_masks.h): `normals`
// holds their normalised sum there (of quads: quad_masks.h), the direction in which such a vertex
// is displaced. Sides count alike, however many faces they have.
struct LimitSurface {
  Eigen::Matrix3Xd positions;       // column = limit position
  Eigen::Matrix3Xd normals;         // column = unit limit normal
  Eigen::Matrix3Xd sector_normals;  // column = unit normal of a side, see split_normals.h
};
// INVALID_ARGUMENT for another level, or unless control_points has a column a control vertex.
absl::StatusOr<LimitSurface> EvaluateLimit(const LoopRefinement& refinement,
                                           const Eigen::Matrix3Xd& control_points, int level,
                                           const RunContext& context);

// INVALID_ARGUMENT or RESOURCE_EXHAUSTED unless limits can be evaluated at `level`.
absl::Status CheckLimitLevel(const LoopRefinement& refinement, int level);

}  // namespace rilievo
