// Scans out, with all that is known of their points.
#pragma once

#include <ostream>
#include <string>

#include "absl/status/status.h"
#include "client/formats/point_layers.h"
#include "core/geometry/point_cloud.h"

namespace rilievo {

// Binary little-endian PLY as ReadPlyScan reads it: x y z as doubles; of those that the scan has,
// normals as float nx ny nz, the number of the station as int station (-1: not known) and an
// element station with x y z as doubles, uchar red green blue, float intensity. INVALID_ARGUMENT
// for sights or layers that are not those of the points.
absl::Status WritePlyScan(const PointCloud& scan, const PointLayers& layers, std::ostream& out);

// The same to `path`; atomic, see WriteFileAtomically().
absl::Status WritePlyScan(const std::string& path, const PointCloud& scan,
                          const PointLayers& layers);

}  // namespace rilievo
