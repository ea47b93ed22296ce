// Which of the two orientations of consistently oriented parts of a scan is the outward one.
#pragma once

#include <vector>

#include "core/points/oriented_cloud.h"

namespace rilievo {

// By component +1 or -1: the factor that turns its normals outward. `component`: by point, a number
// in [0, count), each at least once. A part of which much more is turned up than down (+z) is one
// that was seen from above, as a terrain and a street are; any other has outside where its volume
// is positive: exactly so when it is closed, and on the convex side when it is open. Where neither
// side plainly is convex, outward is towards +y or +x.
std::vector<int> OutwardSigns(const OrientedCloud& cloud, const std::vector<int>& component,
                              int count);

}  // namespace rilievo
