// Settings of displacement/plate.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

// The penalised least squares (solve_heights.h). Lengths are in local point spacings unless said
// otherwise; the accuracy of the fit hardly changes within half and twice of each.
struct SolveSettings {
  // Filter lengths that are tried: from the shortest, each `length_ratio` times the one before,
  // below the longest. The shortest lets heights follow single points.
  double shortest = 0.25, length_ratio = 1.5, longest = 9;
  // Before the points' weights are known, with a filter of one spacing: the distance from the
  // domain at which a point weighs a quarter.
  double near_domain = 2;
  // The domain says that each height is 0, and weighs so many points. Where few points lie between
  // creases, at which the plate ends, heights would else be as large as they like: a quarter of the
  // Booleans of scans had spikes of 1 to 5 % of the diagonal. Three times as much changes nothing,
  // ten times as much costs a clean scan 0.4 % of its RMS error.
  double domain_weight = 1e-4;
  // Where no points are, a slope decays over a control edge, and a height over so many.
  double height_range = 6;
  // Points to a region that has a filter length of its own.
  double region_points = 40;
  // Degrees of freedom that the fit of the domain took for each of its control vertices; they
  // are three coordinates each, of which those along the surface fit little.
  double freedom_of_vertex = 1.5;
  // The filter that flat triangles are by themselves, in edges; measured by the trace of the fit
  // (Hutchinson 1990) where an edge is about a spacing.
  double filter_of_edge = 0.24;
  // Residual at which a point's weight is a quarter, in the larger of its noise and
  // kCommon.little_noise spacings.
  double robust_residual = 5;
  // Conjugate gradients: steps on each level, and where heights are only to be compared; and the
  // residual, relative to the right side, that ends them. With twice the steps RMS errors are the
  // same within 0.02 %, and a million points take 1.4 times as long.
  int steps = 20, trial_steps = 10;
  double residual = 1e-4;  // that residual
  // Heights between points this far apart or nearer are measured, and flagged as smoothed where the
  // filter is longer than `smoothed`; points of less weight than `least_weight` measure nothing.
  double reach = 2, smoothed = 0.7, least_weight = 0.25;
};
RILIEVO_SETTINGS SolveSettings kSolve;

}  // namespace rilievo
