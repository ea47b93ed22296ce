// Where a height comes from; all that a decoder knows of the sampler.
#pragma once

#include <cstdint>

namespace rilievo {

// Where a height comes from.
enum class HeightSource : uint8_t {
  kMeasured = 0,  // a virtual triangle (or local plane) of points pierced by the normal ray
  kSmoothed = 1,  // measured, then moved by the input-dependent Laplacian by more than the noise
  kFilled = 2,    // no data there: interpolated from the heights around it
};

}  // namespace rilievo
