// Heights over some control faces of a surface, apart from the others.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/sample_displacement.h"
#include "core/loop/sub_mesh.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/height_source.h"

namespace rilievo {

// Of all vertices of the faces, face by face.
struct HeightsOfFaces {
  std::vector<float> heights;
  std::vector<HeightSource> sources;
  double leverage = 1;  // as in DisplacementField
};

// Heights at `level` of those faces of `sub` whose numbers there are in `inner`, ascending; from
// all points of `cloud`. Without points all are 0, and filled.
absl::StatusOr<HeightsOfFaces> MeasureFaces(const SubMesh& sub, const std::vector<int>& inner,
                                            const OrientedCloud& cloud, int level,
                                            const DisplacementOptions& options,
                                            const RunContext& context);

}  // namespace rilievo
