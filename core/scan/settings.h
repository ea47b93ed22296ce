// Settings of scan.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct ScanSurfaceSettings {
  double many = 0.02;  // of the points
};
RILIEVO_SETTINGS ScanSurfaceSettings kScanSurface;

}  // namespace rilievo
