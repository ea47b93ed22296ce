// Settings of displacement.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct ContinueCurvatureSettings {
  int most_steps = 8;        // of Gauss and Newton
  double least_move = 1e-5;  // of the diagonal; the last step is shorter
  // Around what moves, the rings with a curvature; one ring more has the places that this is of.
  int curvature_rings = 2;
  // Waves shorter than 2 pi times this share of a part's radius are taken for errors of the heights
  // around it. They would grow inwards by the square of the radius in edges.
  double noise_share = 0.1;
  double band_share = 1.0 / 3;       // of the radius: where heights around it are smoothed
  double least_double_area = 1e-16;  // of a triangle, unit frame
  double least_share = 0.25;         // of a third of the faces around, in an area
  int most_continued = 1 << 14;      // vertices that move together; a larger hole keeps its plate
};
RILIEVO_SETTINGS ContinueCurvatureSettings kContinueCurvature;

struct SampleColorsSettings {
  int steps = 4;  // of reweighted least squares; the first has no weights
  // Median distances of the points' colours from those at their feet at which a point counts a
  // quarter, but of a channel's 256 values no fewer than `least_scale`.
  double scales = 4;
  double least_scale = 4;  // of 256 values
  // Sums are taken in integers, so that their order does not show.
  double units = 1 << 16;
};
RILIEVO_SETTINGS SampleColorsSettings kSampleColors;

}  // namespace rilievo
