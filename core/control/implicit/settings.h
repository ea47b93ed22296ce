// Settings of control/implicit.
#pragma once

#include <cstdint>
#include <numbers>

#include "core/base/ablation.h"

namespace rilievo {

struct ImplicitFunctionSettings {
  // The coarsest grid has about this many cells along the diagonal.
  double coarsest_cells = 28;
  // Free space around the box of the points at the coarsest level, in cells.
  int padding_cells = 5;
  int max_levels = 9;  // of grids
  // A point is active at a level when its own spacing is at most this many cells.
  double spacing_per_cell = 2.5;
  // So many points are enough for the face of a cell.
  double points_per_cell = 5;
  double most_stride = 1024;  // one of so many points at the most stands for the others
  // A normal is inconsistent when the function, 1 from side to side, falls by this much from this
  // many cells behind the point to as many before it.
  double probe_cells = 0.75;
  double inconsistent_drop = 0.15;  // so much
  double few_turned = 5e-5;         // of all points: not worth another solution
  // The most nodes of the finer grids together. Surfaces ask for 1 to 3 a point. Walls as thin as
  // the spacing ask for up to 15; of dense scans they are a small part. Points along curves would
  // have 50, most of the memory of a job; they get coarser cells.
  int64_t nodes_beside = 60'000, nodes_of_point = 16, nodes_of_further_point = 5;
  int64_t few_points = 50'000;  // of which each may have nodes_of_point
  int64_t nodes_of_cell = 9;    // of each that is cut into eight, about
};
RILIEVO_SETTINGS ImplicitFunctionSettings kImplicitFunction;

struct PoissonSolverSettings {
  double relative_residual = 2e-3;  // of the right-hand side; the surface is fitted later
};
RILIEVO_SETTINGS PoissonSolverSettings kPoissonSolver;

struct SizingFieldSettings {
  // What makes a point one of another sheet: an opposite normal, and more across than along.
  double across_share = 0.6;
  // Sheets that no neighbour lies on are looked for across a gap, by every fourth point.
  int probe_stride = 4;
  // A sheet or a border that fewer of a point's neighbours see is chance.
  int least_witnesses = 2;
  // Free of neighbours as seen from a point on a border: 180 degrees on a straight one; within a
  // surface one point in 200 sees so much by chance.
  double free_angle = 5 * std::numbers::pi / 6;
  double even_share = 0.6;  // of the even spacing, the least the cell follows
};
RILIEVO_SETTINGS SizingFieldSettings kSizingField;

struct TrilinearStencilSettings {
  double smallest_disc = 0.7;  // cells; smaller discs are their centre
};
RILIEVO_SETTINGS TrilinearStencilSettings kTrilinearStencil;

}  // namespace rilievo
