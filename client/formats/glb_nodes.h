// The scene of a glTF file, flattened.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/glb_document.h"

namespace rilievo {

// A mesh where the scene has it.
struct PlacedMesh {
  uint64_t mesh = 0;  // number in "meshes"
  Eigen::Affine3d scene_from_mesh;
};

// The meshes of the default scene, or of all root nodes where the file names none, in the order of
// the nodes. INVALID_ARGUMENT for nodes that are not a tree (glTF 2.0, section 3.5.2), for one more
// than 256 deep, and for a transform that is not one.
absl::StatusOr<std::vector<PlacedMesh>> FlattenScene(const GlbDocument& document);

}  // namespace rilievo
