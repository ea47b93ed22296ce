// Where a height comes from; all that a decoder knows of the sampler.
#pragma once

#include <cstdint>

namespace rilievo {

// Where a height comes from.
enum class HeightSource : uint8_t {
  // A virtual triangle of points, or the planes of an edge, where the normal ray pierces it.
  kMeasured = 0,
  // A weighted fit to the points around the ray; or a spike measured again, or moved: by the
  // input-dependent Laplacian by more than the noise, to a point that the surface passed by, or
  // back to the points from where none was near.
  kSmoothed = 1,
  // No data there: interpolated from the heights around it.
  kFilled = 2,
};

}  // namespace rilievo
