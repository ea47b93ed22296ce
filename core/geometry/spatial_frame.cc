#include "core/geometry/spatial_frame.h"

#include <cmath>

namespace rilievo {

SpatialFrame Rounded(const SpatialFrame& frame) {
  constexpr int kDiagonalDigits = 21, kGrid = 10;
  int exponent = 0;
  std::frexp(frame.diagonal, &exponent);
  const auto rounded = [](double value, int digit) {
    const double result = std::ldexp(std::nearbyint(std::ldexp(value, -digit)), digit);
    return std::isfinite(result) ? result : value;  // too far out for that grid
  };
  SpatialFrame result;
  result.diagonal = rounded(frame.diagonal, exponent - kDiagonalDigits);
  for (int axis = 0; axis < 3; ++axis) {
    result.center[axis] = rounded(frame.center[axis], exponent - 1 - kGrid);
  }
  return result;
}

}  // namespace rilievo
