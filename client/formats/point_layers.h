// What a scan says of its points beside where they are.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace rilievo {

// Which of them are wanted; each costs memory.
struct WantedLayers {
  bool intensity = false;
  bool colors = false;
  bool stations = false, normals = false;  // of PointCloud::sights
};

// One value a point, or empty where the file has none or none was wanted.
struct PointLayers {
  std::vector<float> intensity;                // as in the file
  std::vector<std::array<uint8_t, 3>> colors;  // red, green, blue
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
