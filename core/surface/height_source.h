// Where a height comes from; all that a decoder knows of the sampler.
#pragma once

#include <cstdint>

namespace rilievo {

// Where a height comes from.
enum class HeightSource : uint8_t {
  // Told by the points next to it.
  kMeasured = 0,
  // Told together with the points around it: the fit there is smoother than the points are dense.
  kSmoothed = 1,
  // No data there: interpolated from the heights around it.
  kFilled = 2,
};

}  // namespace rilievo
