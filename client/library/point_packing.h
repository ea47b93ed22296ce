// Points and meshes as the protocol carries them.
#pragma once

#include "core/geometry/point_records.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// What the protocol says of the points before they come: their number, layout and stations, all
// that is known of them; and the number of triangles.
v1::ReconstructHeader HeaderOf(const PointCloud& scan, const PointLayout& layout);

}  // namespace rilievo
