// Colours that show a property of the vertices.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "core/geometry/rgb.h"

namespace rilievo {

// Linear RGB a vertex by its HeightSource: measured stone, smoothed blue, filled orange, anything
// else grey.
Eigen::Matrix3Xf ColorsBySource(std::span<const uint8_t> sources);

// Linear RGB of colours as they are.
Eigen::Matrix3Xf ColorsAsGiven(std::span<const Rgb> colors);

// The colour of a direction: x, y, z from -1 to 1 as red, green, blue from 0 to 1.
Eigen::Matrix3Xf ColorsByNormal(const Eigen::Matrix3Xd& normals);

// Where ColorsByValue() reaches its full colour; 0 when no value is finite and other than 0.
float FullColorValue(std::span<const float> values);

// Diverging from blue (below zero) over near-white to red; full colour at the 98th percentile of
// |value| of those other than 0: many may be 0 exactly. Non-finite values are grey.
Eigen::Matrix3Xf ColorsByValue(std::span<const float> values);

}  // namespace rilievo
