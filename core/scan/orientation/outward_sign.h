// Which of the two orientations of a consistently oriented patch of points is the outward one.
#pragma once

#include <span>

#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// +1 or -1: the factor that turns the normals of `members` (not empty) outward. On a closed or
// nearly closed surface the extreme points of all directions agree; on an open sheet, where they
// do not, outward is the convex side, and up (+z, else +y, else +x) when no side plainly is. After
// a stop request it may be either; the caller asks context.CheckStop() after.
int OutwardSign(const OrientedCloud& cloud, std::span<const int> members,
                const RunContext& context);

}  // namespace rilievo
