// An implicit function whose zero set follows the oriented points: screened Poisson on a cascade of
// sparse grids.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/implicit/grid_hierarchy.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct ImplicitOptions {
  // Cell around a point, in spacings: twice as large where the surface bends little, half as large
  // around the border of an open scan, where the function has support on one side only. [0.25, 8].
  double cell_spacings = 1.3;
  // Where sheets lie back to back the cell shrinks to this share of their distance, but never below
  // half of the above. (0, 1].
  double cell_thicknesses = 0.45;
  // No cell is asked for that is smaller than so many times the noise there, or the median noise
  // where that is more. [0, 16].
  double cell_noises = 1.5;
  // Weight of f(p_i) = 0 against the gradient, dimensionless. [0, 100].
  double screening = 2.0;
  // A point lies this deep in cells of its own level. [2, 8].
  int band_cells = 3;
  // All around is outside: the zero set closes over openings.
  bool closed = false;
};

// A function on nested grids, coarse to fine. Every cell of a level is either cut into eight cells
// of the next or a leaf; the function is the trilinear one of the leaves.
struct ImplicitFunction {
  std::vector<GridLevel> levels;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // unit frame
  // Of the cloud's points: -1 where the function gave the normal the other side, else 1.
  std::vector<int8_t> sides;

  double finest_cell() const { return levels.back().cell; }
};

// The most nodes of a function of so many points, those of its coarsest grid aside: finest levels
// that would make more are left out.
int64_t MostImplicitNodes(int64_t points);

// Minimises  sum_edges (f_j - f_i - b_e)^2 + screening * sum_i s_i f(p_i)^2  on each grid, where
// b_e is the point normals, weighted by each point's share of area in cell units (s_i) and spread
// trilinearly to the edges around it: Kazhdan and Hoppe 2013 with a staggered grid in place of an
// octree. The coarsest grid covers the whole box; each finer one is a band around the points that
// ask for it (see SizingField), with the coarser solution as its border and as its first guess.
// The memory of `graph` goes before the grids are made.
absl::StatusOr<ImplicitFunction> FitImplicitFunction(const OrientedCloud& cloud,
                                                     NeighborGraph graph, const PointIndex& index,
                                                     const ImplicitOptions& options,
                                                     const RunContext& context);

}  // namespace rilievo
