// Points and meshes as the protocol carries them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/point_records.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// What the protocol says of the points before they come: their number, layout and stations, all
// that is known of them; and the number of triangles.
v1::ReconstructHeader HeaderOf(const PointCloud& scan, const PointLayout& layout);

// A surface to bring up to date by points in its frame.
struct UpdatedSurface {
  std::vector<uint8_t> dss;  // whole
  int64_t vertices = 0;      // of its finest level
  bool whole = false;        // see v1::BaseSurface
};

v1::BaseSurface ProtoBase(const UpdatedSurface& base);

}  // namespace rilievo
