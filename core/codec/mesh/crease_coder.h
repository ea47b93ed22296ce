// The crease and corner tags of a control mesh as bytes.
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

// Sharpness as the format keeps it: a multiple of 1/16, at least one of them, at most
// kInfiniteSharpness, which stands for all beyond.
float StoredSharpness(float sharpness);

// One flag an edge in the order of the topology, likelier where the faces fold and where a tagged
// edge ends; then the sharpness of each, mostly that of the one before; then a flag a vertex.
// `topology` and `points`: of the mesh, in coding order. INVALID_ARGUMENT for a tag that is not an
// edge or vertex, is listed out of order, or has a sharpness that is not stored exactly.
absl::StatusOr<std::vector<uint8_t>> EncodeCreases(const ControlMesh& mesh,
                                                   const MeshTopology& topology,
                                                   const std::vector<GridPoint>& points);

// Puts the tags into `mesh`. DATA_LOSS when the bytes end early or name a sharpness of none.
absl::Status DecodeCreases(std::span<const uint8_t> bytes, const MeshTopology& topology,
                           const std::vector<GridPoint>& points, ControlMesh& mesh);

}  // namespace rilievo
