// The virtual triangle of a normal ray (Jeong and Kim 2002, section 4.3).
#pragma once

#include <optional>
#include <span>

#include "core/displacement/rays/neighbor_queue.h"

namespace rilievo {

struct VirtualTriangle {
  int corners[3];        // places in the queue
  float barycentric[3];  // of the point where the ray pierces it
  float height;          // signed distance along the ray
  float area;
};

// Longest queue that is searched; later points are ignored.
inline constexpr int kMostTriangleCorners = 256;

struct TriangleRules {
  float max_spacings = 4;      // longest edge, in local spacings (and noises)
  float reference_height = 0;  // where the surface is expected
  // Points off the surface by as much as between them: only the shape across the ray counts.
  bool noisy = false;
};

// Takes the three nearest points of `queue` (ascending); if the ray pierces their triangle, that
// is the one; else adds the next point and tries all new triangles with it. Of several the one of
// smallest area, where an area counts more the farther its height lies from the reference. A
// triangle with too long edges, or that stands against the normals of its own corners, is none: it
// would join two sheets or span a hole.
std::optional<VirtualTriangle> FindVirtualTriangle(std::span<const QueuedPoint> queue,
                                                   const RayCloud& cloud, const Ray& ray,
                                                   const TriangleRules& rules);

}  // namespace rilievo
