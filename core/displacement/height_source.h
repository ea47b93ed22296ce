// Where a height comes from; all that a decoder knows of the sampler.
#pragma once

#include <cstdint>

namespace rilievo {

// Where a height comes from.
enum class HeightSource : uint8_t {
  kMeasured =
      0,  // a virtual triangle of points, or the planes of an edge, where the ray pierces it
  kSmoothed = 1,  // a weighted fit to the points around the ray; or a spike measured again, or
                  // moved by the input-dependent Laplacian by more than the noise
  kFilled = 2,  // no data there: interpolated from the heights around it
};

}  // namespace rilievo
