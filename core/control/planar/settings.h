// Settings of control/planar.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct HarmonicFillSettings {
  double hold = 1e-9;  // to the mean, so weak that it only settles pieces that nothing else holds
};
RILIEVO_SETTINGS HarmonicFillSettings kHarmonicFill;

struct OccupiedAreaSettings {
  double own_disc = 0.9;         // radius, in its own spacings, of what a point fills of the raster
  double largest_raster = 1000;  // cells along a side
};
RILIEVO_SETTINGS OccupiedAreaSettings kOccupiedArea;

struct PlanarControlMeshSettings {
  // The smallest hole that is kept open holds this many control faces.
  double hole_faces = 2;
};
RILIEVO_SETTINGS PlanarControlMeshSettings kPlanarControlMesh;

struct PlaneFrameSettings {
  double facing_cosine = 0.174;  // 80 degrees
  // What a height field joins: a cell and the nearest within so many in its column and in its row.
  int joined_cells = 2;
  // Of the median spacing: a point that is farther from the others stands for no more area than
  // this.
  double widest_spacing = 4;
};
RILIEVO_SETTINGS PlaneFrameSettings kPlaneFrame;

struct PlaneLatticeSettings {
  int smallest_island = 6;     // faces
  double farthest_draw = 0.6;  // edges a vertex moves to reach the border
  double min_roundness = 0.3;  // of a face whose vertex was drawn to the border
  int lattice_rounds = 4;      // of relaxation, before and after the border is drawn to
};
RILIEVO_SETTINGS PlaneLatticeSettings kPlaneLattice;

struct SheetTestSettings {
  // Cells between two sheets: over a plane, a slope of 68 degrees has none.
  double sheet_gap = 2.5;
  // Share of the cells that must hold one sheet, where a topology for such was asked for.
  double least_single_sheet = 0.8;
};
RILIEVO_SETTINGS SheetTestSettings kSheetTest;

}  // namespace rilievo
