// The height at a crease or corner, from the planes that meet there.
#pragma once

#include <optional>
#include <span>

#include "core/displacement/rays/neighbor_queue.h"

namespace rilievo {

struct CreaseFit {
  float height;
  float deviation;  // RMS distance of the points to the planes, over the root of their number
};

// A triangle whose corners lie on different sides of an edge cuts the edge off. Here the points
// around the ray are parted into two planes (at a corner three) by their normals, then by their
// distances; where the planes meet convexly the ray leaves the solid at the lower of them, where
// concavely at the higher. Taken only if the planes describe all the points clearly better than
// one quadric does, which has as many unknowns as two planes: so a surface that is merely curved
// is left alone. `queue`: the nearest points, ascending; `noise`: what the points scatter anyway.
std::optional<CreaseFit> FitCrease(std::span<const QueuedPoint> queue, const RayCloud& cloud,
                                   const Ray& ray, float noise);

inline constexpr int kMostCreasePoints = 64;

}  // namespace rilievo
