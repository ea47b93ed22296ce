#include "core/displacement/local_fit/fit_sums.h"

#include <cstring>

#include "core/base/wide_registers.h"

namespace rilievo {
namespace {

using Lanes = WideLanes;
using Stretch = WideStretch;
using Quad = float __attribute__((vector_size(4 * sizeof(float))));

// The sums of the lanes of four.
[[gnu::always_inline]] inline void SumLanes(const Lanes* four, float* sums) {
  Quad halves[8], parts[4];
  std::memcpy(halves, four, sizeof(halves));
  for (int k = 0; k < 4; ++k) parts[k] = halves[2 * k] + halves[2 * k + 1];
  const Quad first = __builtin_shufflevector(parts[0], parts[1], 0, 4, 1, 5) +
                     __builtin_shufflevector(parts[0], parts[1], 2, 6, 3, 7);
  const Quad second = __builtin_shufflevector(parts[2], parts[3], 0, 4, 1, 5) +
                      __builtin_shufflevector(parts[2], parts[3], 2, 6, 3, 7);
  const Quad all = __builtin_shufflevector(first, second, 0, 1, 4, 5) +
                   __builtin_shufflevector(first, second, 2, 3, 6, 7);
  std::memcpy(sums, &all, sizeof(all));
}

template <bool kQuadric>
[[gnu::always_inline]] inline FitSums Sum(const FitPoints& points) {
  Lanes monomials[kQuadric ? 16 : 8] = {}, heights[kQuadric ? 8 : 4] = {};
  for (int i = 0; i < points.count; i += kWideLanes) {
    const Lanes u = *reinterpret_cast<const Stretch*>(points.u + i) * points.scale,
                v = *reinterpret_cast<const Stretch*>(points.v + i) * points.scale;
    const Lanes height = *reinterpret_cast<const Stretch*>(points.height + i);
    Lanes weight = *reinterpret_cast<const Stretch*>(points.weight + i);
    const Lanes kernel = 1.0f - u * u - v * v;
    weight *= kernel > 0.0f ? kernel : 0.0f;
    const Lanes wu = weight * u, wv = weight * v;
    const Lanes wuu = wu * u, wuv = wu * v, wvv = wv * v;
    monomials[0] += weight;
    monomials[1] += wu;
    monomials[2] += wv;
    monomials[3] += wuu;
    monomials[4] += wuv;
    monomials[5] += wvv;
    heights[0] += weight * height;
    heights[1] += wu * height;
    heights[2] += wv * height;
    if constexpr (kQuadric) {
      const Lanes uu = u * u, uv = u * v, vv = v * v;
      monomials[6] += wuu * u;
      monomials[7] += wuu * v;
      monomials[8] += wvv * u;
      monomials[9] += wvv * v;
      monomials[10] += wuu * uu;
      monomials[11] += wuu * uv;
      monomials[12] += wuu * vv;
      monomials[13] += wvv * uv;
      monomials[14] += wvv * vv;
      heights[3] += wuu * height;
      heights[4] += wuv * height;
      heights[5] += wvv * height;
    }
  }
  FitSums sums = {};
  for (int m = 0; m < (kQuadric ? 16 : 8); m += 4) SumLanes(monomials + m, &sums.monomials[m]);
  for (int m = 0; m < (kQuadric ? 8 : 4); m += 4) SumLanes(heights + m, &sums.heights[m]);
  return sums;
}

}  // namespace

RILIEVO_WIDE FitSums SumForPlane(const FitPoints& points) { return Sum<false>(points); }

RILIEVO_WIDE FitSums SumForQuadric(const FitPoints& points) { return Sum<true>(points); }

}  // namespace rilievo
