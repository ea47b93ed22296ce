// Meshes as small binary glTF 2.0 files.
#pragma once

#include <ostream>
#include <span>

#include "absl/status/status.h"
#include "client/formats/glb_writer.h"

namespace rilievo {

// What WriteGlbMesh() writes, quantised (KHR_mesh_quantization) and compressed
// (EXT_meshopt_compression, by libmeshoptimizer): positions as whole multiples of `step`, scan
// unit, so that meshes of one step that share a vertex have it at the same place; 0 is the longest
// side of the bounding box by 65535, so that none moves by more than 2^-16 of its diagonal; normals
// as octahedra of 8 bits (Meyer et al. 2010, "On floating-point normal vectors"); places of a
// texture as 16 bits; sources, colours and intensity as they are. Vertices and triangles come in
// another order, and vertices that no triangle has are left out. The errors of WriteGlbMesh();
// INVALID_ARGUMENT for a mesh of more than 65535 steps along a side.
absl::Status WriteCompressedGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                                    std::ostream& out, const PointLayers& layers = {},
                                    const ScanPlace& place = {},
                                    const GlbTexture* texture = nullptr, double step = 0);

}  // namespace rilievo
