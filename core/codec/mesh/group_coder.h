// Groups of control faces as bytes: for a file whose groups are not those of its control points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {

// The group of each face in the order of the faces: mostly that of a neighbour with a smaller
// number (docs/dss-format.md, section 4.5).
std::vector<uint8_t> EncodeGroups(const FaceGroups& groups, const MeshTopology& control);

// DATA_LOSS when the bytes end early, name a group that there is not, or give one a size that
// GroupFaces() with this `limit` would not.
absl::StatusOr<FaceGroups> DecodeGroups(std::span<const uint8_t> bytes, const MeshTopology& control,
                                        int limit);

}  // namespace rilievo
