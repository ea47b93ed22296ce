// Binary digits that control points on the boundary have past the step of the others, as bytes.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

inline constexpr int kMostBorderDigits = 16;

// Of control points on the boundary with so many more binary digits than the others, which are on
// a grid of `step`. Exact.
inline double BorderStep(double step, int digits) { return std::ldexp(step, -digits); }

// Coordinates of points on the boundary past those of their grid points, in coding order and
// without a model. `past`: by vertex, in border steps, [-2^(digits - 1), 2^(digits - 1)); those
// inside are not looked at. `digits`: [1, kMostBorderDigits].
std::vector<uint8_t> EncodeBorderDigits(const std::vector<GridPoint>& past,
                                        const MeshTopology& topology, int digits);

// Moves the control points on the boundary of `mesh`, whose grid has this `step`. DATA_LOSS when
// the bytes end early.
absl::Status DecodeBorderDigits(std::span<const uint8_t> bytes, const MeshTopology& topology,
                                double step, int digits, ControlMesh& mesh);

}  // namespace rilievo
