// A given mesh refined by the schemes of the literature.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/run_context.h"
#include "core/geometry/polygon_mesh.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Borders are curves of their own: cubic B-splines (kLoop, kCatmullClark, kSqrt3), quadratic ones
// (kDooSabin), or interpolated by the 4-point scheme (kButterfly). Edges of the border are split in
// three by every second step of kSqrt3 and stay as they are in the others.
enum class SubdivisionScheme {
  kLoop,          // Loop 1987; triangles
  kCatmullClark,  // Catmull and Clark 1978
  kDooSabin,      // Doo and Sabin 1978
  kButterfly,     // Zorin, Schroeder and Sweldens 1996; triangles, passes through all vertices
  kSqrt3,         // Kobbelt 2000; triangles
};

// "loop", "catmull-clark", "doo-sabin", "butterfly", "sqrt3"; INVALID_ARGUMENT for others.
absl::StatusOr<SubdivisionScheme> SchemeNamed(absl::string_view name);

inline constexpr int kMostSubdivisionLevels = 8;
inline constexpr int64_t kMostSubdividedCorners = int64_t{1} << 28;

// Sharp edges and vertices, as in ControlMesh; of kLoop alone.
struct SubdivisionTags {
  std::vector<Crease> creases;
  std::vector<int> corners;
};

// `levels` steps, [0, kMostSubdivisionLevels]. Vertices that a scheme keeps come first, in their
// order (all schemes but kDooSabin); then one for each edge, then one for each face.
// INVALID_ARGUMENT for coordinates that are not finite, faces that are not an orientable manifold
// (BuildPolygonTopology), polygons where the scheme takes triangles, tags where it knows none, and
// for tags that are not of the mesh; RESOURCE_EXHAUSTED when the faces of the last level would have
// more than kMostSubdividedCorners corners; CANCELLED. `refined`, where given, gets the tags of the
// last level: what is left of the sharpness of creases inside, and the corners.
absl::StatusOr<PolygonMesh> SubdivideMesh(const PolygonMesh& mesh, SubdivisionScheme scheme,
                                          int levels, const SubdivisionTags& tags,
                                          const RunContext& context,
                                          SubdivisionTags* refined = nullptr);

}  // namespace rilievo
