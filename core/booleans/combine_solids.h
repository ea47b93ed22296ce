// Union, intersection and difference of two solids given by their triangles.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

enum class SolidOperation { kUnion, kIntersection, kDifference };

struct CombinedSolids {
  TriangleMesh mesh;      // closed and oriented; frame of the inputs, without normals
  int64_t crossings = 0;  // where an edge of one solid meets a face of the other
  int64_t cut_faces = 0;  // triangles of both solids that were cut
};

// The two meshes must be closed and oriented, and not overlap themselves; they may have several
// components, cavities and handles. Vertices that stay keep their places, and all triangles that
// the other mesh does not meet stay as they are. The result is an oriented 2-manifold without
// boundary, because how its parts hang together follows from signs alone, which are exact and
// consistent (after J. Smith, "Towards robust inexact geometric computation", PhD thesis, Cambridge
// 2009).
// Where the shapes touch (see Growth): solids that share a part of a face are joined by a union,
// and a difference leaves no skin where faces lie in one plane; an intersection of what only
// touches is empty. What hangs together in a point or along an edge only is apart (see
// SeparateContacts()). INVALID_ARGUMENT for coordinates that are not finite or a mesh without
// triangles; FAILED_PRECONDITION for a mesh that is open, not oriented, inside out or overlaps
// itself where the other meets it, where both touch too flatly to tell what hangs together (either
// solid grown has to give the same components and genus), and when nothing is left; CANCELLED.
absl::StatusOr<CombinedSolids> CombineSolids(const TriangleMesh& a, const TriangleMesh& b,
                                             SolidOperation operation, const RunContext& context);

}  // namespace rilievo
