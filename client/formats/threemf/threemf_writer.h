// Meshes as 3MF (3D Manufacturing Format, core specification 1.3), which names its unit.
#pragma once

#include <ostream>

#include "absl/status/status.h"
#include "client/formats/point_layers.h"
#include "core/geometry/scan_place.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// One object: a model where the mesh is closed, else a surface. Units that the format knows stay,
// others become millimetres, and a unit that is not known counts as one millimetre. Programs keep
// float coordinates, so these are written. Where the way up is known it becomes z, in the transform
// of the build item. Colours, if any one a vertex, are those of the materials extension.
// INVALID_ARGUMENT without triangles, or beyond 4 GiB of text.
absl::Status Write3mfMesh(const TriangleMesh& mesh, std::ostream& out,
                          const PointLayers& layers = {}, const ScanPlace& place = {});

}  // namespace rilievo
