// Points that heights over a control mesh's surface hardly come to.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct UncoveredPoints {
  std::vector<Eigen::Vector3d> points;  // some of the cloud's, unit frame
  int faces = 0;                        // nearest to these points
};

// Where a point counts as out of reach.
struct CoverageLimits {
  // It lies farther off the surface than this many of its spacings and of its noises. > 0.
  double spacings, noises;
  double cosine;  // and the cosine of its normal and the surface's is less
};

// Points out of reach of a Loop surface, creases included: a tip that was cut off, the sides of two
// prongs with a web between them. Heights along the surface's normals come to few of them, and a
// fit gives few of them to a sample. Where noise sets the limit, a point that is alone on its face
// does not count. The surface is one through the vertices of `control`, which is not fitted yet.
// INVALID_ARGUMENT for a mesh that is not a manifold; CANCELLED when stopped.
absl::StatusOr<UncoveredPoints> FindUncoveredPoints(const OrientedCloud& cloud,
                                                    const ControlMesh& control,
                                                    const CoverageLimits& limits,
                                                    const RunContext& context);

}  // namespace rilievo
