// A mesh as a dense scan of itself, without noise.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/rgb.h"
#include "core/meshes/check_mesh.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

// How many points a mesh of so many triangles gets on them at least: one for each, 100 000 to
// kMostPointsOnMesh.
int64_t FewestPointsOnMesh(int64_t triangles);
inline constexpr int64_t kMostPointsOnMesh = 250'000;

// How many points `mesh` gets, in these bounds: so many that in the mean over its surface an arc
// from one point to the next rises by `most_sagitta` of the diagonal at most, for that is what
// heights at points lose. > 0.
int64_t PointsOnMesh(const CheckedMesh& mesh, double most_sagitta);

// `wanted` points all over the triangles, and points as dense along the borders, but no more there;
// fewer where they would be more than kMostPointsOnMesh together.
// Each has the normal of its triangle. A point takes the same share of the area, but on pieces so
// small that they would have few: triangles get theirs in turn, and the places within them follow
// the R2 sequence (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
// `colors`: of the vertices of `mesh`, or empty; those of the points are between them. The result
// has no neighbour graph, and of the figures only the number of points.
absl::StatusOr<ScanSurface> ScanOfMesh(const CheckedMesh& mesh, const std::vector<Rgb>& colors,
                                       int64_t wanted, const RunContext& context);

}  // namespace rilievo
