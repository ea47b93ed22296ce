// Which triangles of a control mesh are halves of one quad, as bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// For each face that no earlier one is paired with: which of its neighbours it is. Those come into
// question that are not paired yet, across edges that are not creases, the longest edge first;
// mostly that is the diagonal. Of one that is left nothing is coded. `topology` and `points`: of
// the mesh, in coding order. INVALID_ARGUMENT unless the diagonals pair up all faces.
absl::StatusOr<std::vector<uint8_t>> EncodeQuads(const ControlMesh& mesh,
                                                 const MeshTopology& topology,
                                                 const std::vector<GridPoint>& points);

// Puts the diagonals into `mesh`, whose creases are there. DATA_LOSS when the bytes end early or
// leave a face without a neighbour to pair with.
absl::Status DecodeQuads(std::span<const uint8_t> bytes, const MeshTopology& topology,
                         const std::vector<GridPoint>& points, ControlMesh& mesh);

}  // namespace rilievo
