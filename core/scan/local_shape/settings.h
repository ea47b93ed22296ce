// Settings of scan/local_shape.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/ablation.h"

namespace rilievo {

struct AdaptivePatchesSettings {
  double normal_error = 0.05;  // radians, expected; from here on a patch is widened
  int max_rounds = 6;          // of widening
  // Noise against spacing from which rounds run on a thinned set: below, one round reaches clearly
  // further than the noise is thick.
  double thinning_ratio = 0.9;
  int max_stride = 64;  // of the thinned set
  // Patches with more thickness than this against their spread say little of their plane.
  double thick = 0.15;
  double trusted_error = 0.25;  // of the normal, radians: above, neighbours of all directions count
  double sharpest_bend = 0.45;  // radians: neighbours that turn more belong to another side
};
RILIEVO_SETTINGS AdaptivePatchesSettings kAdaptivePatches;

struct EstimateNormalsSettings {
  // Growth of the variance along the plane from which a patch counts as widened.
  double widened = 1.3;
  // Variance across a plane, in that of the noise, below which a clean patch is taken for flat.
  double flat = 2;
  double bend_ratio = 6.0;     // of the noise variance, below which nothing bends
  double flatter_ratio = 0.2;  // a curved surface stays above
  // Variance across a patch in that of the noise: below, next to none of the points has two sides.
  double thicker = 1.5;
};
RILIEVO_SETTINGS EstimateNormalsSettings kEstimateNormals;

// A stretch of the Morton curve has at least so many points. The noise of each is at most `bound`
// times that of the stretch.
struct NoiseStretch {
  int64_t points;
  double bound;
};
struct MeasurementNoiseSettings {
  // The shortest tells the noise, where edges and creases leave it enough flat points.
  std::array<NoiseStretch, 3> stretches = {{{128, 1.0}, {1024, 1.5}, {8192, 2.0}}};
  double share = 0.35;  // quantile of the residuals of a stretch that is taken for their noise
  // This quantile of clean Gaussian noise over 11 degrees of freedom, divided by its deviation.
  double quantile_of_gaussian = 0.91;
};
RILIEVO_SETTINGS MeasurementNoiseSettings kMeasurementNoise;

struct QuadricResidualSettings {
  double two_sheets = 0.16;  // Otsu's share within, below which heights are those of two sheets
  double flat = 0.01;        // of the radius: no second sheet
};
RILIEVO_SETTINGS QuadricResidualSettings kQuadricResidual;

struct RobustNormalSettings {
  static constexpr int most_points = 18;  // the point itself and 17 neighbours
  int nearest = 9;                        // neighbours of which pairs span planes
  // Heights that a plane explains: the finest scale, noise added, and the coarsest.
  double fine_spacings = 0.005;
  double coarse_spacings = 0.2;  // the coarsest
  double least_weight = 1e-9;    // of a point off the plane: else planes may have too few
  double sine = 0.3;             // of the least angle at which two neighbours span a plane
  // Seven points lie on some quadric, of an edge too.
  int fewest_robust_neighbors = 9;
};
RILIEVO_SETTINGS RobustNormalSettings kRobustNormal;

struct SeparateSheetsSettings {
  // How clearly sheets must stand apart (SheetGap), and beside points at which they do. What is
  // left within the sheets is 0.36 of Gaussian heights, 0.25 of uniform ones, 0.19 of those of a
  // rod, 0.2 of sheets four deviations apart; the points between them are 0.21, 0.17, 0.14 and
  // 0.09.
  double clear_within = 0.2, clear_between = 0.09;
  double beside_clear_within = 0.25, beside_clear_between = 0.13;  // beside such points
  // One point of each stretch of the Morton curve is looked at first, and a stretch has at least so
  // many points: a wall of any size holds more. With 3, RMS is 1 % less and time 4 % more.
  int64_t fewest_per_look = 11;
  // Thickness of a list against its width below which nothing else lies in it.
  double thin = 0.12;
  // Variance across a list of one sheet, against that of a list from both.
  double thinner = 0.65;
};
RILIEVO_SETTINGS SeparateSheetsSettings kSeparateSheets;

struct SharpenNormalsSettings {
  int fewest_points = 16;     // of a patch in which a crease is looked for
  int rounds = 3;             // in which points and the two planes find each other
  double off_weight = 0.02;   // weight of a point off both planes
  double fewest_of_bend = 4;  // points on either side
  double most_cost = 1.5;     // a point; of noise alone 1
  size_t enough = 64;         // of which the nearest are nearly those of all points
};
RILIEVO_SETTINGS SharpenNormalsSettings kSharpenNormals;

struct ThickNoiseSettings {
  int most_samples = 384;  // points whose noise is measured in wider balls
  int least_samples = 32;  // fewer answers than this tell nothing
  double most_scale = 4;   // times the noise that neighbourhoods show
  // Below the middle: edges and bumps within a neighbourhood only ever add to the residual.
  double quantile = 0.4;
  // Of a neighbourhood along the tangent plane, and of the ball that it is taken from.
  int fit_points = 60;
  static constexpr int most_ball_points = 4096;  // the most of a ball
  double ball_growth = 200;  // points more, for the squared ratio of noise and spacing
  // Balls for the noise that the one before has shown, while it grows.
  int looks = 3;
  // Points of another sheet: they face away.
  double least_agreement = 0.2;
  // Noise, in spacings, above which the nearest points tell it too small.
  double understated_noise = 1.0 / 3;
};
RILIEVO_SETTINGS ThickNoiseSettings kThickNoise;

struct TwoSheetsSettings {
  int fewest_of_sheet = 14;  // points
  // Share of the squares within from which a quadric with a step will not part them either.
  double reject = 0.33;
  // From sheet to sheet along their plane, against the distance of points within one.
  double most_apart = 1.4;
  int rounds = 3;  // in which the sheets are told apart and their quadric is fitted
};
RILIEVO_SETTINGS TwoSheetsSettings kTwoSheets;

}  // namespace rilievo
