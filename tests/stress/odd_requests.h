// Requests that nobody would send: every option at the ends of its range and beyond, over clouds
// that are hardly scans and triangles that are hardly meshes.
#pragma once

#include <cstdint>
#include <string>

#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo::stress {

struct OddRequest {
  v1::ReconstructHeader header;
  std::string points;     // as header.coordinate_format says
  std::string triangles;  // of a mesh
};

// The same for the same two numbers. Most have only options that the server takes together, by its
// own words; a few are left as they were drawn.
OddRequest DrawOddRequest(uint64_t seed, uint64_t number);

}  // namespace rilievo::stress
