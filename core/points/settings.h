// Settings of points.
#pragma once

#include <cstdint>
#include <numbers>

#include "core/base/ablation.h"

namespace rilievo {

struct BatchedNearestSettings {
  // Measured along Morton curves. In reaches: how far the places of a run may lie from their
  // middle, and how far beyond them points are gathered.
  double run_radius = 1.5, margin = 1.25;
  int64_t most_places = 64;  // of a run
  int fewest_places = 4;     // for fewer, gathering does not pay
  // A place that lies alone would have its run gather all of a dense part.
  int most_gathered = 1024;
  int most_counted = 128;  // points that are sorted by counting; more of them as usual
};
RILIEVO_SETTINGS BatchedNearestSettings kBatchedNearest;

// Thresholds that more than one room takes: of one sheet, of sides of an edge, of gaps and noise.
struct CommonSettings {
  // Least cosine between two normals of one sheet, edges included: half a corner of a cube has
  // 0.58. The other sheet of a wall has about -1.
  double same_sheet = 0.3;
  // And on one side of an edge: 45 degrees. Below the negative of it normals are opposite.
  double same_side = 0.7;
  // And where a surface is smooth: 26 degrees.
  double smooth_cosine = 0.9;
  // Sides that meet at this angle or more make a sharp edge.
  double sharp_angle = std::numbers::pi / 6;
  // Radius of the disc that a point covers, in its spacings: discs overlap about twice.
  double disc_spacings = 0.75;
  // Nothing lies between points that are farther apart than so many spacings.
  double gap_spacings = 3;
  // Deviations of noise that explain a distance.
  double noise_deviations = 3;
  // Noise in spacings: below clean_noise a scan is clean, and each point a point of the surface; up
  // to little_noise its spacing tells more than its noise; from thick_noise_ratio on the nearest
  // points tell nothing of edges, and what they show of the noise is corrected in full.
  double clean_noise = 0.05, little_noise = 0.15, thick_noise_ratio = 0.5;
  // Points that are asked what is at a place: the nearest ones; more at borders and creases, where
  // those may lie on another sheet; around an edge, a disc of 3.5 spacings' radius.
  static constexpr int near_points = 8, points_by_border = 32, points_by_edge = 48;
  // Those that stand for all of a scan where a mean or a median will do.
  int sampled_points = 256;  // see above
  // Fewer points tell nothing; and nothing of a plane, as that of a patch or of a side of an edge.
  int fewest_witnesses = 3, fewest_of_plane = 6;
  // Rounds in which points and sides find each other.
  int side_rounds = 4;
  // Twice the log-likelihood ratio from which two sides are sure, against one smooth surface; and
  // the deviations from them, in noises, beyond which the points lie on no two sides at all.
  double sure_evidence = 20, noises_off_sides = 1.25;
  // What sums in double leave of a difference that is none, relative.
  double rounding = 1e-9;
  // What moves by less of the diagonal has come to rest.
  double at_rest = 1e-8;
};
RILIEVO_SETTINGS CommonSettings kCommon;

struct HeightFieldSettings {
  // Added to the diagonal of a fit to points as far away as 1, for points on one line leave it
  // undetermined.
  double ridge = 1e-6;
};
RILIEVO_SETTINGS HeightFieldSettings kHeightField;

struct NeighborGraphSettings {
  // The most that may be asked for; the size of arrays on the stack.
  static constexpr int most_neighbors = 64;
};
RILIEVO_SETTINGS NeighborGraphSettings kNeighborGraph;

struct PointIndexSettings {
  // Measured at 100 000 and 1 000 000 points: 8 to 16 are alike. Their nodes take 9 bytes a point,
  // those of leaves of 12 points 12.
  int leaf_size = 16;
  // Points of a tree: nothing can stop FLANN while it builds one, 0.3 s for so many.
  int64_t most_tree_points = 1 << 19;
};
RILIEVO_SETTINGS PointIndexSettings kPointIndex;

}  // namespace rilievo
