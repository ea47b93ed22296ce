// The coordinates of a point.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/running_median.h"

namespace rilievo::laz {

// x and y from the median of recent steps of points of the same return context, z from the last
// one of the same level; how large the steps in x (and y) were is the context of y (and z).
// Integers are modulo 2^32. Isenburg 2013, section "Compressing point10".
class PlaceDecoder {
 public:
  explicit PlaceDecoder(uint32_t first_z) { last_z_.fill(first_z); }

  // Moves x and y from the last point to this. `single`: 1 for the only return of a pulse, else 0.
  void MoveXY(ArithmeticDecoder* decoder, uint32_t return_context, uint32_t single, uint32_t* x,
              uint32_t* y) {
    *x += DecodeStep(decoder, &dx_, single, &median_dx_[return_context]);
    const uint32_t size_of_dx = std::min(dx_.magnitude() & ~1u, 20u);
    *y += DecodeStep(decoder, &dy_, single + size_of_dx, &median_dy_[return_context]);
  }

  // After MoveXY(); `level`: below 8.
  uint32_t DecodeZ(ArithmeticDecoder* decoder, uint32_t level, uint32_t single) {
    const uint32_t mean_size = (dx_.magnitude() + dy_.magnitude()) / 2;
    return last_z_[level] += z_.Decode(decoder, single + std::min(mean_size & ~1u, 18u));
  }

 private:
  static uint32_t DecodeStep(ArithmeticDecoder* decoder, IntegerDecoder* steps, uint32_t context,
                             RunningMedian* median) {
    const uint32_t step = static_cast<uint32_t>(median->Get()) + steps->Decode(decoder, context);
    median->Add(static_cast<int32_t>(step));
    return step;
  }

  IntegerDecoder dx_{32, 2}, dy_{32, 22}, z_{32, 20};
  std::array<RunningMedian, 16> median_dx_, median_dy_;  // by return context
  std::array<uint32_t, 8> last_z_;
};

}  // namespace rilievo::laz
