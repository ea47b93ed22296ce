// Grey colours of a scan that has an intensity.
#pragma once

#include "absl/status/status.h"
#include "client/formats/scan_reader.h"

namespace rilievo {

// Replaces the colours of the points by greys. The hundredth of the points with the lowest
// intensities is black, the hundredth with the highest is white, and between them grey is in
// proportion to the intensity. Points whose intensity is not finite are black. INVALID_ARGUMENT
// where the scan has no intensity, or the same for nearly all points.
absl::Status ColorByIntensity(ScanFile* scan);

}  // namespace rilievo
