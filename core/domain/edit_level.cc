#include "core/domain/edit_level.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// Row = vertex, column = control point.
Weights PositionWeights(const LimitStencils& stencils, Eigen::Index control_count) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(stencils.position.size());
  for (int v = 0; v < stencils.size(); ++v) {
    for (int i = stencils.begin[v]; i < stencils.begin[v + 1]; ++i) {
      entries.emplace_back(v, stencils.control_vertices[i], stencils.position[i]);
    }
  }
  Weights weights(stencils.size(), control_count);
  weights.setFromTriplets(entries.begin(), entries.end());
  return weights;
}

// From the vertices to their targets.
Eigen::Matrix3Xd WaysTo(const Eigen::Matrix3Xd& targets, const LimitSurface& limit,
                        const std::vector<float>& heights) {
  Eigen::Matrix3Xd ways = targets - limit.positions;
  for (Eigen::Index v = 0; v < ways.cols(); ++v) {
    ways.col(v) -= double{heights[static_cast<size_t>(v)]} * limit.normals.col(v);
  }
  return ways;
}

}  // namespace

absl::StatusOr<ControlMesh> ControlMeshThrough(const DisplacedSurface& surface, int level,
                                               const Eigen::Matrix3Xd& targets,
                                               const RunContext& context) {
  ControlMesh mesh = surface.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(mesh, std::max(0, level - 1), context));
  RILIEVO_ASSIGN_OR_RETURN(const LimitStencils stencils,
                           BuildLimitStencils(refinement, level, context));
  const Weights weights = PositionWeights(stencils, mesh.vertices.cols());
  const Eigen::SparseMatrix<double> normal_matrix = weights.transpose() * weights;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal_matrix);
  if (solver.info() != Eigen::Success) {
    return absl::FailedPreconditionError(
        absl::StrCat("the vertices of level ", level, " do not determine the control points"));
  }
  for (int round = 0; round < kEditLevel.rounds; ++round) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                             EvaluateLimit(refinement, mesh.vertices, level, context));
    const Eigen::MatrixX3d ways = WaysTo(targets, limit, surface.heights).transpose();
    const Eigen::MatrixX3d moves = solver.solve(weights.transpose() * ways);
    if (!moves.allFinite()) {
      return absl::FailedPreconditionError(
          absl::StrCat("the vertices of level ", level, " do not determine the control points"));
    }
    mesh.vertices += moves.transpose();
    if (moves.squaredNorm() <=
        kEditLevel.settled * kEditLevel.settled * static_cast<double>(moves.rows()))
      break;
  }
  return mesh;
}

absl::StatusOr<TargetsMissed> MoveHeightsTo(const Eigen::Matrix3Xd& targets, int level,
                                            const RunContext& context, DisplacedSurface* surface) {
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface->control_mesh, std::max(0, surface->max_level - 1), context));
  RILIEVO_ASSIGN_OR_RETURN(
      const LimitSurface limit,
      EvaluateLimit(refinement, surface->control_mesh.vertices, level, context));
  const Eigen::Matrix3Xd ways = WaysTo(targets, limit, surface->heights);
  DisplacedSurface change;
  change.max_level = level;
  TargetsMissed missed;
  double squared = 0;
  for (Eigen::Index v = 0; v < ways.cols(); ++v) {
    const double along = ways.col(v).dot(limit.normals.col(v));
    change.heights.push_back(static_cast<float>(along));
    const double left = (ways.col(v) - along * limit.normals.col(v)).norm();
    squared += left * left;
    missed.max = std::max(missed.max, left);
  }
  missed.rms = std::sqrt(squared / static_cast<double>(ways.cols()));
  const std::vector<float> changes = HeightsAtLevel(change, refinement, surface->max_level);
  for (size_t v = 0; v < changes.size(); ++v) surface->heights[v] += changes[v];
  return missed;
}

}  // namespace rilievo
