// What the control points already coded say about the face across a border edge. Integers only,
// so that encoder and decoder see the same on every machine.
#pragma once

#include <array>
#include <cstdint>

namespace rilievo {

// A control point in steps of the position quantiser, each coordinate within +-kMaxCoordinate.
using GridPoint = std::array<int32_t, 3>;
inline constexpr int32_t kMaxCoordinate = 1 << 27;

// Angle at `corner` between the directions to `p` and `q`, in 1/2048 of a half turn, [0, 2048],
// within 1 % or so; 0 where one of them is the corner itself.
int CornerAngle(const GridPoint& corner, const GridPoint& p, const GridPoint& q);

// log2 of the squared distance of `p` and `q` in units of the squared length of edge `a` `b`,
// from 0 (at most 2^-5) to 11 (at least 2^6).
int RelativeDistance(const GridPoint& p, const GridPoint& q, const GridPoint& a,
                     const GridPoint& b);

// The fourth corner of the parallelogram over edge a, b that turns its back on `apex`.
GridPoint Parallelogram(const GridPoint& a, const GridPoint& b, const GridPoint& apex);

// Direction of the normal of triangle a, b, apex, its longest coordinate of at most 29 bits.
std::array<int64_t, 3> GateNormal(const GridPoint& a, const GridPoint& b, const GridPoint& apex);

// Bits of the longest coordinate difference of a and b.
int EdgeBits(const GridPoint& a, const GridPoint& b);

}  // namespace rilievo
