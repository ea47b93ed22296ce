// What a scan says of its points beside where they are.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/geometry/rgb.h"

namespace rilievo {

class Trajectory;

// Takes a scan's points as they are read. It remembers what went wrong.
class PointSink {
 public:
  virtual ~PointSink() = default;
  // So many more are to come, where the file tells; 0 where some are chosen among them. Reading
  // ends with this error.
  virtual absl::Status Expect(uint64_t points) = 0;
  // Column = point, as in the file. Reading ends with this error, but for the last points.
  virtual absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) = 0;
};

// Which of them are wanted; each costs memory.
struct WantedLayers {
  bool intensity = false;
  bool colors = false, stations = false, normals = false;  // of PointCloud::sights
  // The points of these classes alone (LAS: 2 is ground, 6 buildings); empty: all points.
  std::vector<uint8_t> classes = {};
  // The last return of each pulse alone (LAS, LAZ): what lies behind leaves that let it through.
  bool last_returns = false;
  // Where the sensor was at the times of the points (LAS, LAZ); null: not known.
  const Trajectory* trajectory = nullptr;
  // Takes the points instead of the cloud, which stays without any; null: none does. Layers are
  // not to be wanted then.
  PointSink* sink = nullptr;
};

// One value a point or vertex, or empty where there are none or none were wanted.
struct PointLayers {
  std::vector<float> intensity;  // as in the file
  std::vector<Rgb> colors;       // of vertices; those of points are in PointCloud::sights
};

// INVALID_ARGUMENT unless each layer is empty or has `count` values.
inline absl::Status CheckLayers(const PointLayers& layers, int64_t count) {
  for (const size_t size : {layers.intensity.size(), layers.colors.size()}) {
    if (size == 0 || static_cast<int64_t>(size) == count) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("a layer of ", size, " values for ", count, " vertices"));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
