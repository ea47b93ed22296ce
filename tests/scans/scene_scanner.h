// Scans of scenes, with the truth of what was seen.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"
#include "tests/scans/scene.h"

namespace rilievo {

struct SceneScanOptions {
  int64_t points = 100000;  // [1, 5e7]
  // Standard deviation of the range, fraction of the diagonal of the scene. [0, 0.1].
  double noise = 0;
  // No return comes from a face seen at a flatter angle (from its normal). (0, 90], degrees.
  double max_incidence_degrees = 85;
  uint64_t seed = 1;
};

struct SceneScan {
  PointCloud cloud;              // station by station, or strip by strip; with its stations
  std::vector<uint8_t> is_leaf;  // by point, whether it comes from a crown
  // By triangle of the truth: 0 unseen, 1 seen from outside, -1 from its other side.
  std::vector<int8_t> seen;
};

// Same scene, options and seed: same bytes. Stations spread their rays evenly in both angles, a
// flight along its strips; each delivers an equal share of the points. FAILED_PRECONDITION when one
// of them meets the scene too seldom.
absl::StatusOr<SceneScan> ScanScene(const Scene& scene, const SceneScanOptions& options);

}  // namespace rilievo
