// What all rooms take for one sheet, one side of an edge, a gap, and for noise.
#pragma once

#include <numbers>

namespace rilievo {

// Least cosine between two normals of one sheet, edges included: half a corner of a cube has 0.58.
// The other sheet of a wall has about -1.
inline constexpr double kSameSheet = 0.3;
// And on one side of an edge: 45 degrees. Below the negative of it normals are opposite.
inline constexpr double kSameSide = 0.7;
// And where a surface is smooth: 26 degrees.
inline constexpr double kSmoothCosine = 0.9;
// Sides that meet at this angle or more make a sharp edge.
inline constexpr double kSharpAngle = std::numbers::pi / 6;

// Radius of the disc that a point covers, in its spacings: discs overlap about twice.
inline constexpr double kDiscSpacings = 0.75;
// Nothing lies between points that are farther apart than so many spacings.
inline constexpr double kGapSpacings = 3;

// Deviations of noise that explain a distance.
inline constexpr double kNoiseDeviations = 3;

// Points nearest to a place that are asked what is there; the fewest that make out a side of an
// edge.
inline constexpr int kNearPoints = 8, kFewestOfSide = 6;

// What sums in double leave of a difference that is none, relative.
inline constexpr double kRounding = 1e-9;

}  // namespace rilievo
