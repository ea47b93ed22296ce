// The nested grids of an implicit function: where each is refined, and its values handed on.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/implicit/sparse_grid.h"

namespace rilievo {

// One grid; position of node (x, y, z) is origin + cell * (x, y, z), the origin being that of the
// function. Node x of a level and node 2 x of the next are the same place.
struct GridLevel {
  SparseGrid grid;
  std::vector<float> values;  // per node; negative inside, positive outside
  double cell = 0;            // unit frame

  // Lower corner of the cell that holds a position.
  Eigen::Vector3i CellOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& position) const {
    return ((position - origin) / cell).array().floor().cast<int>();
  }
  // Trilinear; 0 outside the grid.
  double ValueAt(const Eigen::Vector3d& origin, const Eigen::Vector3d& position) const;
};

// The cells of each level but the last that have to be cut into eight, so that every point lies
// `band_cells` deep in cells of its own level, and cells that touch differ by one level at most.
// `level_of_point`: in [0, level_count). Result: level_count - 1 grids whose nodes are the lower
// corners of cells.
absl::StatusOr<std::vector<SparseGrid>> CellsToRefine(const Eigen::Matrix3Xd& points,
                                                      const std::vector<uint8_t>& level_of_point,
                                                      const Eigen::Vector3d& origin,
                                                      double coarsest_cell, int level_count,
                                                      int band_cells, const RunContext& context);

// The next level: the nodes of the cut cells, with the coarse values interpolated.
absl::StatusOr<GridLevel> RefineCells(const GridLevel& coarse, const SparseGrid& cells,
                                      const RunContext& context);

// Takes over the values of the finer level where both have a node, so that cells of both sizes see
// the same function where they touch.
absl::Status InjectValues(const GridLevel& fine, const RunContext& context, GridLevel* coarse);

}  // namespace rilievo
