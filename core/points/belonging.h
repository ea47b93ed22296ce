// What all rooms take for a smooth surface, for noise, and for too few points.
#pragma once

namespace rilievo {

// Least cosine between two normals where a surface is smooth: 26 degrees.
inline constexpr double kSmoothCosine = 0.9;

// Deviations of noise that explain a distance.
inline constexpr double kNoiseDeviations = 3;
// Noise in spacings: below it a scan is clean, and each point a point of the surface.
inline constexpr double kCleanNoise = 0.05;

// Fewer points tell nothing; and nothing of a plane.
inline constexpr int kFewestWitnesses = 3, kFewestOfPlane = 6;

// What sums in double leave of a difference that is none, relative.
inline constexpr double kRounding = 1e-9;

}  // namespace rilievo
