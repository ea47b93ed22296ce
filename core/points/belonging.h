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

// Noise in spacings: below kCleanNoise a scan is clean, and each point a point of the surface; up
// to kLittleNoise its spacing tells more than its noise; above kThickNoiseRatio the nearest points
// tell the noise too small, and nothing of edges.
inline constexpr double kCleanNoise = 0.05, kLittleNoise = 0.15, kThickNoiseRatio = 0.5;

// Points nearest to a place that are asked what is there; those where these lie on another sheet,
// at borders and at creases; those around an edge, a disc of 3.5
// spacings' radius; those that stand for all of a scan where a mean or a median will do.
inline constexpr int kNearPoints = 8, kPointsByBorder = 32, kPointsByEdge = 48,
                     kSampledPoints = 256;
// Fewer points tell nothing; and nothing of a plane, as that of a patch or of a side of an edge.
inline constexpr int kFewestWitnesses = 3, kFewestOfPlane = 6;
// Rounds in which points and sides find each other.
inline constexpr int kSideRounds = 4;
// Twice the log-likelihood ratio from which two sides are sure, against one smooth surface; and the
// deviations from them, in noises, beyond which the points lie on no two sides at all.
inline constexpr double kSureEvidence = 20, kNoisesOffSides = 1.25;

// What sums in double leave of a difference that is none, relative.
inline constexpr double kRounding = 1e-9;
// What moves by less of the diagonal has come to rest.
inline constexpr double kAtRest = 1e-8;

}  // namespace rilievo
