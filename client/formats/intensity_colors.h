// Grey colours of a scan that has an intensity.
#pragma once

#include "absl/status/status.h"
#include "client/formats/scan_reader.h"

namespace rilievo {

// Gives each point a grey in place of its colour, if any: black at the intensity that a hundredth
// of the points stays below, white at the one that a hundredth exceeds, and in proportion between
// them. Points whose intensity is not finite are black. INVALID_ARGUMENT where the scan has no
// intensity, or the same for nearly all points.
absl::Status ColorByIntensity(ScanFile* scan);

}  // namespace rilievo
