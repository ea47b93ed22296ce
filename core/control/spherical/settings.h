// Settings of control/spherical.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct SphericalControlMeshSettings {
  double least_coverage = 0.5;  // share of directions that must meet points
};
RILIEVO_SETTINGS SphericalControlMeshSettings kSphericalControlMesh;

struct StarShapeSettings {
  int center_samples = 4000;    // points from which the centre is found
  int center_steps = 100;       // of the walk to the centre
  double margin = 0.3;          // wanted cosine between normal and ray
  double radial_cosine = 0.6;   // 53 degrees
  double points_per_cell = 20;  // of a direction cell, on average
};
RILIEVO_SETTINGS StarShapeSettings kStarShape;

}  // namespace rilievo
