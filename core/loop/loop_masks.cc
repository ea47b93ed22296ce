#include "core/loop/loop_masks.h"

#include <cmath>
#include <numbers>

namespace rilievo {

double LoopBeta(int valence) {
  const double c = 3.0 / 8.0 + std::cos(2.0 * std::numbers::pi / valence) / 4.0;
  return (5.0 / 8.0 - c * c) / valence;
}

double LoopLimitWeight(int valence) { return 1.0 / (valence + 3.0 / (8.0 * LoopBeta(valence))); }

LoopLimitMask InteriorLimitMask(int valence) {
  const double weight = LoopLimitWeight(valence);
  LoopLimitMask mask;
  mask.position_self = 1.0 - valence * weight;
  mask.position.assign(valence, weight);
  for (int i = 0; i < valence; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / valence;
    mask.tangent_u.push_back(std::cos(angle));
    mask.tangent_v.push_back(std::sin(angle));
  }
  return mask;
}

LoopLimitMask BoundaryLimitMask(int valence) {
  LoopLimitMask mask;
  mask.position_self = 2.0 / 3.0;
  mask.position.assign(valence, 0.0);
  mask.position.front() = mask.position.back() = 1.0 / 6.0;
  mask.tangent_u.assign(valence, 0.0);
  mask.tangent_u.front() = 1.0;
  mask.tangent_u.back() = -1.0;
  mask.tangent_v.assign(valence, 1.0);
  if (valence == 2) {
    mask.tangent_v_self = -2.0;
    return mask;
  }
  const double theta = std::numbers::pi / (valence - 1);
  const double s = std::sin(theta), c = std::cos(theta);
  mask.tangent_v_self = -s;
  mask.tangent_v.front() = mask.tangent_v.back() = -s * c;
  for (int i = 1; i + 1 < valence; ++i) {
    mask.tangent_v[i] = (1.0 - c) * (1.0 + 2.0 * c) * std::sin(i * theta);
  }
  return mask;
}

}  // namespace rilievo
