// Small scans whose surfaces are known.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/library/jobs_client.h"
#include "core/geometry/point_cloud.h"

namespace rilievo::stress {

struct KnownScan {
  PointCloud cloud;
  PackedScan packed;
  std::vector<uint8_t> surface;  // the .dss that the library makes of it, undisturbed
};

// Of different shapes and of 2 000 to 5 000 points, by the simulator.
const std::vector<KnownScan>& KnownScans();

// A shape of the simulator by its name.
PointCloud Simulated(const char* shape, int64_t points, double noise = 0, uint64_t seed = 1);

}  // namespace rilievo::stress
