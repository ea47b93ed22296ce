// Settings of points/edge_model.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct TwoPlaneModelSettings {
  static constexpr int most_points = 384;  // gathered around an edge: the size of its arrays
  int least_side_points = 8;               // of a side that has a plane
  int bow_rounds = 2;                      // in which plane and bow along the edge find each other
  // Least cosine of a point's normal and the nearer of the faces'.
  double nearer_face = 0.2;
  // Least cosine of a point's normal and the nearer of the sides': others are of a corner's third.
  double own_sides = 0.5;
  // Of the angle between two sides.
  double least_sine = 0.05;
  // Least ratio of the widths of a side's points, squared: below it they lie on a line.
  double least_width = 0.03;
  // Points by the edge lie no farther than a spacing and their noise off either side; the noise
  // counts as this many spacings at least.
  double least_noise_by_edge = 0.1;
  // Evidence beyond doubt: no other neighbourhood is asked.
  double enough = 40;
  // Most of the points around that may belong to another sheet.
  double most_of_others = 0.1;
  // Most cosine of such a point's normal and that of a side that it faces.
  double facing = -0.5;
  // What planes leave of a clean scan's curved sides, in spacings.
  double least_scatter = 0.05;
};
RILIEVO_SETTINGS TwoPlaneModelSettings kTwoPlaneModel;

}  // namespace rilievo
