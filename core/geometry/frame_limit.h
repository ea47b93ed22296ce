// What the frame of a surface may be.
#pragma once

namespace rilievo {

// Longest diagonal, and largest |coordinate| of a centre, that a file holds; scan units.
inline constexpr double kMostFrameLength = 1e300;

}  // namespace rilievo
