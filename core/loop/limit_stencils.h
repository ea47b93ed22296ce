// Limit stencils: limit positions and tangents as weights of control points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/refinement.h"

namespace rilievo {

// The sides of creases and corners, in the order of SectorsOfLevel (split_normals.h). Side s:
// entries [begin[s], begin[s + 1]), tangents as in LimitStencils.
struct SectorStencils {
  std::vector<int> vertices;  // ascending: the stencil each side belongs to
  std::vector<int> begin = {0};
  std::vector<int> control_vertices;
  std::vector<double> tangent_u, tangent_v;
  int size() const { return static_cast<int>(vertices.size()); }
};

// Stencil s: entries [begin[s], begin[s + 1]) of `control_vertices` (ascending) and of the weights.
// `position` weights sum to one, `tangent_u` and `tangent_v` to zero. The limit normal is
// tangent_u x tangent_v, outward. Tangents are not normalised: the masks of loop_masks.h,
// crease_masks.h and quad_masks.h applied at the level that first holds the vertex. A vertex with
// several sides has no tangent plane: its tangents here are the smooth ones of its ring, a
// direction between the sides; its limit normal is the normalised sum of those of its `sectors`
// (SetSharpNormals).
struct LimitStencils {
  std::vector<int> begin = {0};
  std::vector<int> control_vertices;
  std::vector<double> position, tangent_u, tangent_v;
  SectorStencils sectors;
  int size() const { return static_cast<int>(begin.size()) - 1; }
};

// One stencil for each vertex of `level`, 0 to max_level() + 1. INVALID_ARGUMENT for another level,
// RESOURCE_EXHAUSTED when `begin` could not count the entries.
absl::StatusOr<LimitStencils> BuildLimitStencils(const LoopRefinement& refinement, int level,
                                                 const RunContext& context);

// Those of several runs of vertices, in order. Errors as BuildLimitStencils.
absl::Status AppendStencils(std::vector<LimitStencils> more, LimitStencils* all);

// Overwrites the normals of vertices with several sides by the normalised sum of the sides' unit
// normals. A side whose tangents span no plane counts nothing; where the sum vanishes, the normal
// stays. Column = stencil, control vertex.
void SetSharpNormals(const LimitStencils& stencils, const Eigen::Matrix3Xd& control_points,
                     Eigen::Matrix3Xd& normals);

// The distinct vertices of `level` that lie on each control face: its corners, edges and inside,
// (2^level + 1)(2^level + 2) / 2 of them. face f: [f * per_face, (f + 1) * per_face), in rows
// parallel to its side from corner 0 to corner 1: with n = 2^level, row j = 0..n holds the
// parameters (1 - i/n - j/n) corner 0 + i/n corner 1 + j/n corner 2, i = 0..n - j.
struct FaceSamples {
  int per_face = 0;
  std::vector<int> vertices;
};
FaceSamples SamplesOfControlFaces(const LoopRefinement& refinement, int level);

}  // namespace rilievo
