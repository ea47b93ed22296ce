// Two closed meshes on one integer grid.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/booleans/grid_predicates.h"
#include "core/geometry/four_boxes.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Half-edges as in half_edges.h.
struct GridSolid {
  Eigen::Matrix3Xi faces;
  std::vector<GridPoint> points;
  std::vector<GridPoint> points_otherwise;  // moved by as much the other way; empty: none has moved
  std::vector<uint32_t> partner;            // by half-edge: the one across

  const GridPoint& TailOf(uint32_t h) const {
    return points[static_cast<size_t>(Origin(faces, h))];
  }
  const GridPoint& TipOf(uint32_t h) const { return TailOf(NextHalfEdge(h)); }
  GridTriangle TriangleOf(int face) const {
    const auto h = 3 * static_cast<uint32_t>(face);
    return {TailOf(h), TailOf(h + 1), TailOf(h + 2)};
  }
  FloatBox BoxOf(int face) const;
};

// Half the longest side of the joint box of both meshes, in steps of the grid.
inline constexpr int64_t kStepsOfHalfBox = kMostGridCoordinate / 2;

// How contacts are decided: the vertices of one solid move outward by so many steps (inward where
// negative), so that all of its faces do. Far more than rounding to the grid moves any, and too
// little to see. Then whatever lies in one plane or line with something of the other solid overlaps
// it (or is clear of it).
struct Growth {
  size_t side = 0;
  double steps = 0;
};
inline constexpr double kGrowthSteps = 2.5;

// Both meshes on a grid with kStepsOfHalfBox in half the longest side of their joint box.
// INVALID_ARGUMENT for a coordinate that is not finite; FAILED_PRECONDITION where a mesh is not
// closed and oriented, encloses no volume, or is inside out; CANCELLED.
absl::StatusOr<std::array<GridSolid, 2>> PlaceOnGrid(const TriangleMesh& a, const TriangleMesh& b,
                                                     const Growth& growth,
                                                     const RunContext& context);

}  // namespace rilievo
