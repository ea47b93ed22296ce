// Which of the two orientations of consistently oriented parts of a scan is the outward one.
#pragma once

#include <vector>

#include "core/points/oriented_cloud.h"

namespace rilievo {

// By component +1 or -1: the factor that turns its normals outward. `component`: by point, a number
// in [0, count), each at least once. Outside is where the volume is positive: exactly so for a
// closed part, and on the convex side of an open one. Where neither side of an open part plainly is
// the convex one, as of a terrain, outward is up (+z), or towards +y or +x for a vertical one.
std::vector<int> OutwardSigns(const OrientedCloud& cloud, const std::vector<int>& component,
                              int count);

}  // namespace rilievo
