// Where the points of a page lie: in boxes far smaller than that of all of them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

namespace rilievo {

// Points of a page that follow one another on the curve.
struct PageStretch {
  Eigen::AlignedBox3d box;  // of the points, scan frame
  int32_t points = 0;
};

inline constexpr int kStretchesOfPage = 16;

// At most kStretchesOfPage, in order. The curve leaps, and a box around a leap holds much that has
// nothing to do with it. So of all stretches the one with the longest diagonal is cut into two
// until there are so many, at the highest bit in which its codes differ (C. Lauterbach et al., Fast
// BVH Construction on GPUs, Eurographics 2009). `points`: column = point, scan frame, at least one;
// `codes`: of each, ascending (MortonCode).
std::vector<PageStretch> CutStretches(const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                                      std::span<const uint64_t> codes);

}  // namespace rilievo
