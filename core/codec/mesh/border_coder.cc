#include "core/codec/mesh/border_coder.h"

#include "absl/status/status.h"
#include "core/codec/bytes/range_coder.h"

namespace rilievo {
namespace {

template <typename Coder>
void CodeBorderDigits(const MeshTopology& topology, int digits, Coder& coder,
                      std::vector<GridPoint>& past) {
  const int32_t half = 1 << (digits - 1);
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (topology.boundary_vertex[static_cast<size_t>(v)] == 0) continue;
    for (int32_t& coordinate : past[static_cast<size_t>(v)]) {
      const int32_t given = coordinate + half;
      int32_t coded = 0;
      for (int bit = digits - 1; bit >= 0; --bit) {
        coded = 2 * coded + (coder.Code((given >> bit & 1) != 0, 32768) ? 1 : 0);
      }
      coordinate = coded - half;
    }
  }
}

}  // namespace

std::vector<uint8_t> EncodeBorderDigits(const std::vector<GridPoint>& past,
                                        const MeshTopology& topology, int digits) {
  RangeEncoder encoder;
  std::vector<GridPoint> given = past;
  CodeBorderDigits(topology, digits, encoder, given);
  return encoder.Finish();
}

absl::Status DecodeBorderDigits(std::span<const uint8_t> bytes, const MeshTopology& topology,
                                double step, int digits, ControlMesh& mesh) {
  RangeDecoder decoder(bytes);
  std::vector<GridPoint> past(static_cast<size_t>(topology.vertex_count), GridPoint{});
  CodeBorderDigits(topology, digits, decoder, past);
  if (decoder.overrun()) {
    return absl::DataLossError("chunk 0 ends within the digits of its border");
  }
  for (int v = 0; v < topology.vertex_count; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh.vertices(axis, v) += past[static_cast<size_t>(v)][axis] * BorderStep(step, digits);
    }
  }
  return absl::OkStatus();
}

}  // namespace rilievo
