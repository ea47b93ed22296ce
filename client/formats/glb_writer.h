// Meshes as binary glTF 2.0.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <ostream>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "client/formats/glb_clip.h"
#include "client/formats/point_layers.h"
#include "core/geometry/scan_place.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/height_source.h"

namespace rilievo {

// A picture on the mesh.
struct GlbTexture {
  const Eigen::Matrix2Xf& places;  // column = place of a vertex, (0, 0) top left, (1, 1)
  const std::string& png;          // sRGB
};

// One mesh of one primitive: POSITION, NORMAL when the mesh has normals, _SOURCE (see HeightSource)
// when `sources` is not empty (then one a vertex), COLOR_0 and _INTENSITY for layers,
// TEXCOORD_0 and the material's colour for `texture`, morph targets and an animation for `clip`
// (see glb_clip.h), indices.
// Positions are float about the middle of the bounding box, which is the node's translation in
// double, so that map grids keep their detail. A node above it turns the way up of `place` (z where
// it is not known) to y and scales to metres. INVALID_ARGUMENT without vertices or triangles, or
// beyond the 4 GiB of the format.
absl::Status WriteGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          std::ostream& out, const PointLayers& layers = {},
                          const ScanPlace& place = {}, const GlbTexture* texture = nullptr,
                          const GlbClip* clip = nullptr);

// INVALID_ARGUMENT for what WriteGlbMesh() does not take, whatever the size.
absl::Status CheckGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          const PointLayers& layers);

// glTF's vertex colours are linear (section 3.7.2.1), a scan's are sRGB. 16 bits, for 8 linear ones
// would merge dark colours.
std::array<uint16_t, 256> GlbColorsFromSrgb();

}  // namespace rilievo
