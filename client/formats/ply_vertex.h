// Where the vertices of a PLY file are.
#pragma once

#include <array>
#include <cstddef>

#include "absl/status/statusor.h"
#include "client/formats/ply_header.h"

namespace rilievo {

struct PlyVertexLayout {
  size_t element_index = 0;     // in PlyHeader::elements
  std::array<int, 3> position;  // properties x, y, z of it
};

// INVALID_ARGUMENT unless there is exactly one element 'vertex' (or 'point') that is not empty and
// has scalar properties x, y and z, each once.
absl::StatusOr<PlyVertexLayout> FindPlyVertex(const PlyHeader& header);

}  // namespace rilievo
