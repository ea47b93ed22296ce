// How far the rays of a region together follow wide windows.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/displacement/local_fit/scale_ladder.h"

namespace rilievo {

// Rays that lie close together, facing alike.
struct RayGroup {
  Eigen::Vector3f position, direction;
  float spacing;  // of the points there
  std::vector<int> rays;
};

// Selects a scale for every ladder, level by level. The heights of two nested windows on a smooth
// surface differ by what the noise explains; where many rays around differ by more, the wider
// window is off by detail that it spans, and so, by less, is the narrower one. Each group blends
// the wider window in by the share that makes the expected squared error least, found from the mean
// squares within some window radii (empirical Bayes, after James and Stein 1961; stagewise as
// Belomestny and Spokoiny 2007). One result a ladder, in their order; none where a ladder is empty.
// Each ray is in one group.
std::vector<std::optional<FitWindow>> SelectScalesTogether(std::span<const ScaleLadder> ladders,
                                                           std::span<const RayGroup> groups);

}  // namespace rilievo
