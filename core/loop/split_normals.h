// The sides of creases and corners at one level: where a picture or a mesh file wants its normals
// split.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Vertices whose limit surface has two or more sides, ascending, their sides counter-clockwise.
// Sector s lies at vertices[s] and has the face corners [begin[s], begin[s + 1]) of `half_edges`,
// counter-clockwise: 3 f + k is corner k of face f (half_edges.h). Semi-sharp edges split nothing:
// they are smooth in the limit. Column s of LimitSurface::sector_normals is the unit normal of
// sector s.
struct SharpSectors {
  std::vector<int> vertices;
  std::vector<int> begin = {0};
  std::vector<uint32_t> half_edges;
  int size() const { return static_cast<int>(vertices.size()); }
};

// Level 0 to max_level() + 1; INVALID_ARGUMENT for another.
absl::StatusOr<SharpSectors> SectorsOfLevel(const LoopRefinement& refinement, int level);

}  // namespace rilievo
