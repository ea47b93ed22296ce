// Which of the two orientations of a consistently oriented patch of points is the outward one.
#pragma once

#include <span>

#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {

// The mean winding number at points of a surface, each standing for its share of it: a sample of
// `members`, evenly along the list.
double MeanWinding(const WindingField& field, const OrientedCloud& cloud,
                   std::span<const int> members);

// +1 or -1 where the surface tells by itself which factor turns the normals of `members` (not
// empty) outward, else 0. A closed surface has a mean winding number of 1/2 on itself where its
// normals point outward, and of -1/2 where they point inward; an open one of nearly 0, and outward
// is the convex side where one plainly is.
int OwnOutwardSign(const OrientedCloud& cloud, std::span<const int> members);

// +1 or -1: its own, or the one that turns it up (+z, else +y, else +x).
int OutwardSign(const OrientedCloud& cloud, std::span<const int> members);

}  // namespace rilievo
