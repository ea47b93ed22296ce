#include "core/displacement/regularize/height_bounds.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/displacement/regularize/settings.h"

namespace rilievo {

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
  const auto within = [&](float curvature) {
    return curvature * most_height > kHeightBounds.fold_margin
               ? kHeightBounds.fold_margin / curvature
               : most_height;
  };
  return {-within(most), within(-least)};
}

}  // namespace rilievo
