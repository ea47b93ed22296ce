// Settings of displacement/regularize.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct HeightBoundsSettings {
  float fold_margin = 0.9f;  // of the radius of curvature: higher, the surface folds
};
RILIEVO_SETTINGS HeightBoundsSettings kHeightBounds;

}  // namespace rilievo
