// Gaps in the creases of a control mesh, where the points around an edge lie on more than two
// sides.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Tags the ways of at most three edges that lead on from the free end of a crease to a vertex of
// the same or another crease, turning by at most 60 degrees in every vertex, where the faces beside
// each of their edges meet at 40 degrees or more. Near a corner, and beside a strip narrower than
// its points are judged by, two sides do not explain the points, but the mesh, whose ends of the
// gap lie on their creases, shows the fold. `tags`: 1 for each edge of `topology`, that of `mesh`,
// that lies on a crease.
void CloseCreaseGaps(const ControlMesh& mesh, const MeshTopology& topology,
                     std::vector<uint8_t>* tags);

}  // namespace rilievo
