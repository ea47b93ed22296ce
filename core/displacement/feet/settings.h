// Settings of displacement/feet.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

// How the foot of a point is found (feet/point_feet.h).
struct FeetSettings {
  int walk_steps = 40;    // triangles crossed before a walk is given up
  int newton_steps = 8;   // to invert a prism
  double arrived = 1e-2;  // distance from the point, in edges
  double outside = 1e-4;  // barycentric coordinate below 0 that still counts as inside
  double farthest = 50;   // barycentric coordinates of a step that diverged
  // To points that have no prism: the length of the way, in spacings, and the least cosine between
  // it and the limit normal.
  double farthest_way = 4, along_way = 0.5;
  static constexpr int tries = 24;  // nearest triangles from which a walk begins
};
RILIEVO_SETTINGS FeetSettings kFeet;

}  // namespace rilievo
