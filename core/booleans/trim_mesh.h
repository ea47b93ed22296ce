// The part of a mesh on one side of a shape, with a border on it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/booleans/trim_shape.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

enum class KeptSide { kInside, kOutside };

struct TrimmedMesh {
  TriangleMesh mesh;      // without normals
  int64_t cut_faces = 0;  // triangles of the given mesh that were split
};

inline constexpr size_t kMostTrimFaces = size_t{1} << 24;

// `mesh`: an oriented manifold, open or closed. Triangles that the shape meets are split where it
// crosses their edges, beforehand into smaller ones where the shape is curved, so vertices of the
// border lie on the shape, and its edges within kTrimTolerance of the diagonal of `mesh`; vertices
// nearer to the shape than that count as on it. Both sides come of the same
// triangles, so their borders are the same edges, to the last bit. Vertices that stay keep their
// places. INVALID_ARGUMENT as BoundsOf(), for a mesh without triangles and for coordinates that are
// not finite; FAILED_PRECONDITION when nothing is left, and when more than `most_added` triangles
// would be added; CANCELLED.
absl::StatusOr<TrimmedMesh> TrimMesh(const TriangleMesh& mesh, const TrimShape& shape,
                                     KeptSide kept, const RunContext& context,
                                     size_t most_added = kMostTrimFaces);

// The same of a closed mesh, closed again along the shape: CombineSolids() with the shape as a
// solid, and its errors.
absl::StatusOr<TrimmedMesh> TrimSolid(const TriangleMesh& mesh, const TrimShape& shape,
                                      KeptSide kept, const RunContext& context);

}  // namespace rilievo
