// A small software rasteriser: surfaces and point sets as shaded pictures.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "client/picture/camera.h"
#include "client/picture/image.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct Scene {
  // Drawn as triangles, or as points when there are none. Normals are used when given.
  TriangleMesh mesh;
  // Column = linear RGB in [0, 1]; empty (a neutral stone colour) or one a vertex.
  Eigen::Matrix3Xf colors;
};

struct PictureOptions {
  int width = 960, height = 720;  // pixels, [16, 16384]
  Camera camera;
  // One normal a triangle: shows the facets.
  bool flat = false;
  // The edges of the triangles as dark lines.
  bool edges = false;
  // The scene keeps its place and size at every turn of the camera (see CylinderAround).
  bool steady = false;
  absl::Status Validate() const;
};

// Light from over the camera's left shoulder, a headlight and an ambient part; back faces are lit
// alike but red, so that what is inside out or missing shows. Two by two samples a pixel. White
// background. The same picture for any thread count. INVALID_ARGUMENT for indices out of range.
absl::StatusOr<Image> RenderPicture(const Scene& scene, const PictureOptions& options,
                                    const RunContext& context);

// `views` pictures, 2 to 4, on one sheet of options.width x options.height: the camera of
// `options`, from behind, from above and from below.
absl::StatusOr<Image> RenderSheet(const Scene& scene, const PictureOptions& options, int views,
                                  const RunContext& context);

}  // namespace rilievo
