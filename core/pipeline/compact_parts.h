// A control mesh in compact parts.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// All faces, ascending in each part, of which none has more than `most`. `mesh`: unit frame;
// `topology`: of it.
std::vector<std::vector<int>> CompactParts(const ControlMesh& mesh, const MeshTopology& topology,
                                           int64_t most);

}  // namespace rilievo
