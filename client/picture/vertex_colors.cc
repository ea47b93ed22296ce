#include "client/picture/vertex_colors.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace rilievo {
namespace {

using Eigen::Vector3f;

const Vector3f kGrey(0.35f, 0.35f, 0.35f);

}  // namespace

Eigen::Matrix3Xf ColorsBySource(std::span<const uint8_t> sources) {
  const Vector3f of_source[] = {
      {0.66f, 0.62f, 0.54f}, {0.22f, 0.42f, 0.72f}, {0.85f, 0.33f, 0.03f}};
  Eigen::Matrix3Xf colors(3, static_cast<Eigen::Index>(sources.size()));
  for (size_t i = 0; i < sources.size(); ++i) {
    colors.col(static_cast<Eigen::Index>(i)) = sources[i] < 3 ? of_source[sources[i]] : kGrey;
  }
  return colors;
}

Eigen::Matrix3Xf ColorsAsGiven(std::span<const Rgb> colors) {
  Eigen::Matrix3Xf linear(3, static_cast<Eigen::Index>(colors.size()));
  for (size_t i = 0; i < colors.size(); ++i) {
    for (size_t channel = 0; channel < 3; ++channel) {
      linear(static_cast<Eigen::Index>(channel), static_cast<Eigen::Index>(i)) =
          static_cast<float>(LinearFromSrgb(colors[i][channel] / 255.0));
    }
  }
  return linear;
}

Eigen::Matrix3Xf ColorsByNormal(const Eigen::Matrix3Xd& normals) {
  return (0.5 * normals.array() + 0.5).matrix().cast<float>();
}

float FullColorValue(std::span<const float> values) {
  std::vector<float> sizes;
  for (float value : values) {
    if (std::isfinite(value) && value != 0) sizes.push_back(std::abs(value));
  }
  if (sizes.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + rank, sizes.end());
  return sizes[static_cast<size_t>(rank)];
}

Eigen::Matrix3Xf ColorsByValue(std::span<const float> values) {
  const float full = FullColorValue(values);
  const Vector3f middle(0.80f, 0.79f, 0.76f), low(0.03f, 0.13f, 0.55f), high(0.62f, 0.04f, 0.03f);
  Eigen::Matrix3Xf colors(3, static_cast<Eigen::Index>(values.size()));
  for (size_t i = 0; i < values.size(); ++i) {
    const float share = full > 0 ? std::clamp(values[i] / full, -1.f, 1.f) : 0.f;
    const Vector3f& end = share < 0 ? low : high;
    colors.col(static_cast<Eigen::Index>(i)) =
        std::isfinite(values[i]) ? Vector3f(middle + std::abs(share) * (end - middle)) : kGrey;
  }
  return colors;
}

}  // namespace rilievo
