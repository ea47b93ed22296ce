// What stays of the faces of two solids that cut each other.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/booleans/cut_loops.h"
#include "core/booleans/solid_crossings.h"

namespace rilievo {

// By side: whether what lies outside of the other solid stays, or what lies inside.
using KeptOutside = std::array<bool, 2>;

// A point within a face, as a mean of its corners.
struct AddedPoint {
  std::array<int, 3> corners;
  Eigen::Vector3d weights;
};

// Corners are numbered through: the vertices of side 0, those of side 1, the crossings, and points
// that were added within faces. Diagonals are numbered through as well. Triangles face as those of
// their side.
struct KeptFaces {
  std::array<std::vector<CutTriangle>, 2> triangles;  // by side
  std::vector<AddedPoint> added;
  int64_t cut_faces = 0;
};

// A crossing is left by exactly one edge of what stays of a face and reached by one: which, its
// sign says. FAILED_PRECONDITION where that does not come out, because a solid overlaps itself;
// CANCELLED.
absl::StatusOr<KeptFaces> KeepFaces(const std::array<GridSolid, 2>& solids,
                                    const SolidCrossings& crossings, const KeptOutside& outside,
                                    const RunContext& context);

}  // namespace rilievo
