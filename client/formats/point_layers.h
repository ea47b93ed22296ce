// What a scan says of its points beside where they are.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace rilievo {

// Which of them are wanted; each costs memory.
struct WantedLayers {
  bool intensity = false;
  bool colors = false;
};

// One value a point, or empty where the file has none or none was wanted.
struct PointLayers {
  std::vector<float> intensity;                // as in the file
  std::vector<std::array<uint8_t, 3>> colors;  // red, green, blue
};

}  // namespace rilievo
