// A surface as few triangles: fine where it bends, coarse where it is flat, and without cracks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// Exactly one of `tolerance` and `triangles`.
struct AdaptiveOptions {
  // No point of the finest level is farther than this from the mesh; fraction of the diagonal. The
  // mesh' own points are as near but for creases and folds. [0, 1]; 0 gives the finest level
  // wherever it is not flat.
  std::optional<double> tolerance;
  // At most so many triangles, at the smallest such tolerance. At least as many as control faces.
  std::optional<int64_t> triangles;
  // Where the surface is looked at from, scan frame, finite. Then each point's distance is divided
  // by its distance from there, so that tolerance and error are angles in radians: a pixel is about
  // 1e-3 where 1080 of them see 60 degrees. What lies behind others or aside is kept as well.
  std::optional<Eigen::Vector3d> camera;
  absl::Status Validate() const;
};

struct AdaptiveMesh {
  TriangleMesh mesh;          // scan frame
  std::vector<int> vertices;  // of level max_level, ascending: the vertex that each column is
  double error = 0;           // largest such distance, fraction of the diagonal; or angle
};

// Red-green refinement (Bank, Sherman, Weiser 1983) of the nested levels: a face is cut into its
// four children while the finest vertices under it are farther than the tolerance; neighbours
// differ by one level at most, and a face beside a finer one is cut in two or three. So the mesh is
// watertight wherever the control mesh is. Vertices lie on the finest level with that level's
// normals, in its order; triangles come in the order of the control faces. Nothing depends on the
// number of threads. INVALID_ARGUMENT for options out of range or a surface that Tessellate()
// refuses.
absl::StatusOr<AdaptiveMesh> TessellateAdaptively(const DisplacedSurface& surface,
                                                  const AdaptiveOptions& options,
                                                  const RunContext& context);

}  // namespace rilievo
