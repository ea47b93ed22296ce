#include "core/base/xp.h"
#include "core/displacement/regularize/height_bounds.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

constexpr float kFoldMargin = 0.9f;

}  // namespace

HeightBounds BoundsOf(int vertex, const LevelRings& rings, const LimitSurface& limit,
                      double max_height) {
  // Rounded down, for the nearest float may lie above the double.
  const float most_height = std::nextafter(static_cast<float>(max_height), 0.0f);
  float most = 0, least = 0;
  for (const int neighbor : rings.Of(vertex)) {
    const Eigen::Vector3d along = limit.positions.col(neighbor) - limit.positions.col(vertex);
    const double square = along.squaredNorm();
    if (!(square > 0)) continue;
    const Eigen::Vector3d turn = limit.normals.col(neighbor) - limit.normals.col(vertex);
    const float curvature = static_cast<float>(turn.dot(along) / square);
    most = std::max(most, curvature);
    least = std::min(least, curvature);
  }
  if (XP("nobounds")) return {-most_height, most_height};
  const auto within = [&](float curvature) {
    return curvature * most_height > kFoldMargin ? kFoldMargin / curvature : most_height;
  };
  return {-within(most), within(-least)};
}

}  // namespace rilievo
