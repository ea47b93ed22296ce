// A coarse mesh with the colours of the finest level as a picture on it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct TexturedMesh {
  TriangleMesh mesh;  // scan frame; vertices on a border of control faces once for each of them
  std::vector<HeightSource> sources;  // one a vertex
  Eigen::Matrix2Xf texture;           // column = place of the vertex, (0, 0) top left, (1, 1)
  std::string png;                    // sRGB
  int width = 0, height = 0, texture_level = 0;
};

// Triangles of `level`, [0, max_level]; their picture is a colour atlas
// (docs/displacement-atlas.md) of the finest level whose atlas is at most `most_pixels` wide and
// high. INVALID_ARGUMENT when the surface has no colours, for another level, or where even the
// control mesh needs more pixels.
absl::StatusOr<TexturedMesh> MakeTexturedMesh(const DisplacedSurface& surface, int level,
                                              int most_pixels, const RunContext& context);

}  // namespace rilievo
