// How far the rays of a region together follow wide windows.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/displacement/window_ladder.h"

namespace rilievo {

// Rays that lie close together, facing alike.
struct RayGroup {
  Eigen::Vector3f position, direction;
  float spacing;  // of the points there
  std::vector<int> rays;
};

// Climbs all ladders, rung by rung. What two nested windows of a smooth surface say differs by what
// the noise explains; where many rays around differ by more, the wider window is off by detail that
// it spans, and so, by less, is the narrower one. Each group blends the wider window in by the
// share that makes the expected squared error least, found from the mean squares within some window
// radii (empirical Bayes, after James and Stein 1961; stagewise as Belomestny and Spokoiny 2007).
// One result a ladder, in their order; none where a ladder is empty. Each ray is in one group.
std::vector<std::optional<FitWindow>> ClimbTogether(std::span<const WindowLadder> ladders,
                                                    std::span<const RayGroup> groups);

}  // namespace rilievo
