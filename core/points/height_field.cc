#include "core/points/height_field.h"

#include "core/base/wide_registers.h"

namespace rilievo {
namespace {

using Lanes = double __attribute__((vector_size(kHeightFieldLanes * sizeof(double))));
// Anywhere in an array. A copy would pass the wide registers by.
using Stretch = double __attribute__((vector_size(kHeightFieldLanes * sizeof(double)),
                                      aligned(alignof(double)), may_alias));

[[gnu::always_inline]] inline double SumOf(const Lanes& lanes) {
  return (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
}

}  // namespace

RILIEVO_WIDE HeightFieldSums SumHeights(const HeightFieldPoints& points) {
  Lanes monomials[15] = {}, heights[6] = {}, squares = {};
  for (int i = 0; i < points.count; i += kHeightFieldLanes) {
    const Lanes x = *reinterpret_cast<const Stretch*>(points.x + i);
    const Lanes y = *reinterpret_cast<const Stretch*>(points.y + i);
    const Lanes z = *reinterpret_cast<const Stretch*>(points.z + i);
    const Lanes weight = *reinterpret_cast<const Stretch*>(points.weight + i);
    const Lanes wx = weight * x, wy = weight * y, wz = weight * z;
    const Lanes wxx = wx * x, wxy = wx * y, wyy = wy * y;
    const Lanes xx = x * x, xy = x * y, yy = y * y;
    monomials[0] += weight;
    monomials[1] += wx;
    monomials[2] += wy;
    monomials[3] += wxx;
    monomials[4] += wxy;
    monomials[5] += wyy;
    monomials[6] += wxx * x;
    monomials[7] += wxx * y;
    monomials[8] += wyy * x;
    monomials[9] += wyy * y;
    monomials[10] += wxx * xx;
    monomials[11] += wxx * xy;
    monomials[12] += wxx * yy;
    monomials[13] += wyy * xy;
    monomials[14] += wyy * yy;
    heights[0] += wz;
    heights[1] += wz * x;
    heights[2] += wz * y;
    heights[3] += wz * xx;
    heights[4] += wz * xy;
    heights[5] += wz * yy;
    squares += wz * z;
  }
  HeightFieldSums sums;
  for (int m = 0; m < 15; ++m) sums.monomials[m] = SumOf(monomials[m]);
  for (int m = 0; m < 6; ++m) sums.heights[m] = SumOf(heights[m]);
  sums.squares = SumOf(squares);
  return sums;
}

}  // namespace rilievo
