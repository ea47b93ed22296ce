// OpenSubdiv's Loop or Catmull-Clark surface in double precision, the independent oracle of the
// loop tests.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/loop/refinement.h"

namespace rilievo::testing {

// Every vertex of one level of uniform refinement. Column = vertex, in the refinement's numbering.
struct OracleLevel {
  Eigen::Matrix3Xd positions;  // after subdivision
  Eigen::Matrix3Xd limit_positions;
  Eigen::Matrix3Xd limit_normals;                           // unit, first tangent x second tangent
  Eigen::Matrix<double, 6, Eigen::Dynamic> limit_tangents;  // first above second
};

// All levels of `refinement` with the mesh's creases and corners, boundaries by
// VTX_BOUNDARY_EDGE_ONLY.
std::vector<OracleLevel> EvaluateWithOpenSubdiv(const ControlMesh& mesh,
                                                const LoopRefinement& refinement);

}  // namespace rilievo::testing
