#include "core/codec/heights/height_layer.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "core/base/status_macros.h"
#include "core/codec/bytes/bit_models.h"
#include "core/codec/bytes/magnitude_class.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/bytes/residual_model.h"
#include "core/codec/heights/edge_rules.h"
#include "core/codec/heights/height_range.h"

namespace rilievo {
namespace {

constexpr int kLastClass = 23;  // of magnitudes

int32_t Predict(const EdgeRule& rule, const EdgeStencil& stencil,
                const std::vector<int32_t>& heights) {
  return (WeightedSum(RuleAt(rule, stencil), stencil, heights) + 16) >> 5;
}

// The neighbourhood that one height is coded in.
struct Surroundings {
  int32_t predicted = 0;
  int64_t near_sum = 0;    // |residual| of neighbours of the same level that are coded
  int64_t signed_sum = 0;  // their residuals
  int near_count = 0;
  int64_t coarse_sum = 0;  // |residual| of the coarser neighbours
  int coarse_count = 0;
  int64_t roughness = 0;  // difference between two predictions
  int source = 0;         // of the neighbours: 0 none known, else 1 + the two most relevant
};

// Codes the heights one after the other; the same for encoder and decoder.
template <typename Coder>
class LayerCoder {
 public:
  LayerCoder(Coder& coder, GridHeights& field) : coder_(coder), field_(field) {
    for (auto& input : source_models_) input.resize(2 * kSourceContexts);
  }

  // Vertex `v` must be the next one.
  absl::Status CodeHeight(int v, const Surroundings& around) {
    const bool decodes = Coder::kDecodes;
    const int source = CodeSource(decodes ? 0 : static_cast<int>(field_.sources[v]), around);
    const int coarse = around.coarse_count > 0
                           ? MagnitudeClass(4 * around.coarse_sum / around.coarse_count, kLastClass)
                           : 0;
    const int near = around.near_count > 0
                         ? MagnitudeClass(4 * around.near_sum / around.near_count, kLastClass)
                         : coarse;
    const int rough = MagnitudeClass(4 * around.roughness, kLastClass);
    const int lean = around.signed_sum > 0 ? 2 : around.signed_sum < 0 ? 0 : 1;
    const int32_t given = decodes ? 0 : field_.heights[v] - around.predicted;
    const int32_t residual = residuals_.Code(
        coder_, given, {near * 9 + source * 3 + lean, coarse * 24 + near, rough * 3 + lean});
    const int64_t height = int64_t{around.predicted} + residual;
    if (height < -kMaxHeightSteps || height > kMaxHeightSteps) {
      return HeightOutOfRange();
    }
    if (decodes) {
      field_.heights.push_back(static_cast<int32_t>(height));
      field_.sources.push_back(static_cast<HeightSource>(source));
    }
    field_.residuals.push_back(residual);
    return absl::OkStatus();
  }

 private:
  static constexpr int kLimit = 255, kSourceContexts = 64;

  int CodeSource(int source, const Surroundings& around) {
    const auto bit = [&](bool value, int node) {
      const std::array<BitModel*, 2> inputs = {
          &source_models_[0][node * kSourceContexts + around.source],
          &source_models_[1][node * kSourceContexts + last_source_]};
      return source_mixers_[node].Code(coder_, value, inputs, 1023);
    };
    int coded = 0;
    if (bit(source != 0, 0)) coded = bit(source != 1, 1) ? 2 : 1;
    last_source_ = (last_source_ * 3 + coded) % 27;
    return coded;
  }

  Coder& coder_;
  GridHeights& field_;
  int last_source_ = 0;
  std::array<std::vector<BitModel>, 2> source_models_;
  std::array<BitMixer<2>, 2> source_mixers_;
  ResidualModel<3> residuals_{{24 * 9, 24 * 24, 24 * 3}, kLimit};
};

// The mean of the neighbours that come earlier in the coding order.
Surroundings AroundControlVertex(const VertexRings& rings, int v, const GridHeights& field) {
  Surroundings around;
  int64_t sum = 0;
  int worst = -1, best = 3;
  for (int i = rings.neighbor_begin[v]; i < rings.neighbor_begin[v + 1]; ++i) {
    const int u = rings.neighbors[i];
    if (u >= v) continue;
    sum += field.heights[u];
    around.near_sum += std::abs(int64_t{field.residuals[u]});
    around.signed_sum += field.residuals[u];
    ++around.near_count;
    worst = std::max(worst, static_cast<int>(field.sources[u]));
    best = std::min(best, static_cast<int>(field.sources[u]));
  }
  if (around.near_count == 0) return around;
  // Rounded to the nearest, halves up: floor(sum / count + 1/2), with a floor that also holds
  // below zero.
  const int64_t twice = 2 * sum + around.near_count, divisor = 2 * around.near_count;
  around.predicted = static_cast<int32_t>(twice >= 0 ? twice / divisor : ~(~twice / divisor));
  around.source = 1 + 3 * worst + best;
  return around;
}

Surroundings AroundEdge(const MeshTopology& topology, const EdgeRule& predictor, int edge,
                        const GridHeights& field) {
  Surroundings around;
  const EdgeStencil stencil = StencilOfEdge(topology, edge);
  around.predicted = Predict(predictor, stencil, field.heights);
  int sibling_sources = 0;
  for (int side = 0; side < 2; ++side) {
    const int face = topology.edge_faces(side, edge);
    if (face < 0) break;
    for (int k = 0; k < 3; ++k) {
      const int sibling = topology.face_edges(k, face);
      if (sibling >= edge) continue;
      const int v = topology.vertex_count + sibling;
      around.near_sum += std::abs(int64_t{field.residuals[v]});
      around.signed_sum += field.residuals[v];
      ++around.near_count;
      sibling_sources = std::max(sibling_sources, static_cast<int>(field.sources[v]));
    }
  }
  for (int end : stencil.ends) around.coarse_sum += std::abs(int64_t{field.residuals[end]});
  around.coarse_count = 2;
  if (stencil.interior()) {
    for (int v : stencil.opposite) around.coarse_sum += std::abs(int64_t{field.residuals[v]});
    around.coarse_count = 4;
    around.roughness =
        std::abs(int64_t{field.heights[stencil.ends[0]]} + field.heights[stencil.ends[1]] -
                 field.heights[stencil.opposite[0]] - field.heights[stencil.opposite[1]]);
  }
  around.source = 1 + sibling_sources + 3 * static_cast<int>(field.sources[stencil.ends[0]]) +
                  9 * static_cast<int>(field.sources[stencil.ends[1]]);
  return around;
}

template <typename Coder>
absl::Status CodeLayer(Coder& coder, const MeshTopology& topology, bool level_zero,
                       const EdgeRule& predictor, GridHeights& field) {
  LayerCoder<Coder> layer(coder, field);
  if (level_zero) {
    const VertexRings rings = BuildVertexRings(topology);
    for (int v = 0; v < topology.vertex_count; ++v) {
      RILIEVO_RETURN_IF_ERROR(layer.CodeHeight(v, AroundControlVertex(rings, v, field)));
    }
    return absl::OkStatus();
  }
  for (int edge = 0; edge < topology.edge_count(); ++edge) {
    RILIEVO_RETURN_IF_ERROR(layer.CodeHeight(topology.vertex_count + edge,
                                             AroundEdge(topology, predictor, edge, field)));
  }
  return absl::OkStatus();
}

// The predictor whose residuals have the fewest bits in all.
int BestPredictor(const MeshTopology& topology, const std::vector<int32_t>& heights) {
  std::array<int64_t, kEdgeRules.size()> bits{};
  for (int edge = 0; edge < topology.edge_count(); ++edge) {
    const EdgeStencil stencil = StencilOfEdge(topology, edge);
    const int32_t height = heights[topology.vertex_count + edge];
    for (size_t p = 0; p < kEdgeRules.size(); ++p) {
      bits[p] += std::abs(int64_t{height} - Predict(kEdgeRules[p], stencil, heights));
    }
  }
  return static_cast<int>(std::min_element(bits.begin(), bits.end()) - bits.begin());
}

}  // namespace

std::vector<uint8_t> EncodeHeightLayer(const MeshTopology& topology, bool level_zero,
                                       GridHeights& field) {
  const int predictor = level_zero ? 0 : BestPredictor(topology, field.heights);
  RangeEncoder coder;
  // An encoder's own heights are within range: its caller has checked them.
  CodeLayer(coder, topology, level_zero, kEdgeRules[predictor], field).IgnoreError();
  std::vector<uint8_t> bytes = {static_cast<uint8_t>(predictor)};
  const std::vector<uint8_t> coded = coder.Finish();
  bytes.insert(bytes.end(), coded.begin(), coded.end());
  return bytes;
}

absl::Status DecodeHeightLayer(std::span<const uint8_t> bytes, const MeshTopology& topology,
                               bool level_zero, GridHeights& field) {
  if (bytes.empty() || bytes[0] >= kEdgeRules.size()) {
    return absl::DataLossError("a height layer names no predictor of the format");
  }
  RangeDecoder coder(bytes.subspan(1));
  RILIEVO_RETURN_IF_ERROR(CodeLayer(coder, topology, level_zero, kEdgeRules[bytes[0]], field));
  if (coder.overrun()) return absl::DataLossError("a height layer ends before its last height");
  return absl::OkStatus();
}

}  // namespace rilievo
