// Heights while they are sampled: what the later steps of the stage know of each vertex.
#pragma once

#include <cstdint>
#include <vector>

namespace rilievo {

struct HeightEstimate {
  float height;
  float deviation;  // expected standard deviation of `height`
  float spacing;    // of the points there
  int foot;         // cloud point nearest to where the ray meets the surface
  bool crease;      // told by the planes of an edge or corner
  bool fitted;      // told by many points around the ray, not by the triangle it pierces
};

// One entry per vertex of the finest level.
struct HeightSamples {
  std::vector<float> height;     // along the limit normal, unit frame; 0 where nothing was measured
  std::vector<float> deviation;  // expected standard deviation of the height, from the noise
  std::vector<float> spacing;    // local distance between the points there
  std::vector<int> foot;         // cloud point nearest to where the ray meets the surface, or -1
  std::vector<uint8_t> measured;
  std::vector<uint8_t> crease;  // the height is that of an edge or corner; see FitCrease
  std::vector<uint8_t> fitted;  // the height is not that of a pierced triangle; see kSmoothed

  explicit HeightSamples(size_t count)
      : height(count, 0.0f),
        deviation(count, 0.0f),
        spacing(count, 0.0f),
        foot(count, -1),
        measured(count, 0),
        crease(count, 0),
        fitted(count, 0) {}
  int size() const { return static_cast<int>(height.size()); }
};

}  // namespace rilievo
