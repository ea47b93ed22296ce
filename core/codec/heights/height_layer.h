// The heights of one level's new vertices as bytes, format version 1. Files are written in later
// ones; the encoder here is what the decoder is tested against.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/height_source.h"

namespace rilievo {

// Largest |height| in steps of the height quantiser.
inline constexpr int32_t kMaxHeightSteps = 1 << 22;

// Heights of nested levels in steps of the quantiser, with what coding them has left behind.
struct GridHeights {
  std::vector<int32_t> heights;
  std::vector<HeightSource> sources;
  std::vector<int32_t> residuals;  // prediction error of each, context for its neighbours
};

// Level 0: the heights of all control vertices, [0, topology.vertex_count), are coded; `topology`
// is the control mesh. Level l > 0: `topology` is level l - 1, whose vertices are all done; those
// of the new vertices, one an edge of `topology`, are coded. `field` holds at least the heights and
// sources up to there. Fills in their residuals.
std::vector<uint8_t> EncodeHeightLayer(const MeshTopology& topology, bool level_zero,
                                       GridHeights& field);

// Appends the layer's heights, sources and residuals to `field`. DATA_LOSS when the bytes hold
// fewer, or a height beyond kMaxHeightSteps.
absl::Status DecodeHeightLayer(std::span<const uint8_t> bytes, const MeshTopology& topology,
                               bool level_zero, GridHeights& field);

}  // namespace rilievo
