#include "core/pipeline/compact_parts.h"

#include <cmath>

#include "core/codec/mesh/face_groups.h"
#include "core/pipeline/settings.h"

namespace rilievo {

std::vector<std::vector<int>> CompactParts(const ControlMesh& mesh, const MeshTopology& topology,
                                           int64_t most) {
  std::vector<GridPoint> places(topology.vertex_count);
  for (int v = 0; v < topology.vertex_count; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      places[v][axis] =
          static_cast<int32_t>(std::lround(kCompactParts.grid * mesh.vertices(axis, v)));
    }
  }
  return GroupFaces(topology, places, static_cast<int>(most)).members;
}

}  // namespace rilievo
