#include "core/displacement/regularize/input_laplacian.h"

#include <optional>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;
constexpr float kStep = 0.5f;

// None unless all are measured: a one-sided mean would pull the vertex along the slope of the
// displaced surface. The ring of a rim vertex begins and ends on the rim.
std::optional<float> MeanOfNeighbors(const MeshTopology& finest, const LevelRings& rings,
                                     const std::vector<uint8_t>& measured,
                                     const std::vector<float>& heights, int64_t vertex) {
  const Ring ring = rings.Of(static_cast<int>(vertex));
  const int stride = finest.boundary_vertex[vertex] ? ring.size() - 1 : 1;
  float sum = 0;
  int count = 0;
  for (int r = 0; r < ring.size(); r += stride) {
    if (!measured[ring[r]]) return std::nullopt;
    sum += heights[ring[r]];
    ++count;
  }
  return sum / static_cast<float>(count);
}

}  // namespace

absl::Status SmoothHeights(const MeshTopology& finest, const LevelRings& rings, int rounds,
                           const RunContext& context, HeightSamples* samples) {
  if (IsLeftOut(Mechanism::kInputLaplacian)) return absl::OkStatus();
  const std::vector<float> sampled = samples->height;
  std::vector<float> before;
  for (int round = 0; round < rounds; ++round) {
    before = samples->height;
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(samples->size(), kBlock, context, [&](int64_t begin, int64_t end) {
          for (int64_t v = begin; v < end; ++v) {
            if (!samples->measured[v]) continue;
            const auto mean = MeanOfNeighbors(finest, rings, samples->measured, before, v);
            if (!mean) continue;
            const float bend = *mean - before[v];
            const float noise = samples->deviation[v] * samples->deviation[v];
            const float total = noise + bend * bend;
            if (!(total > 0)) continue;
            const float noise_share = noise / total;
            samples->height[v] = before[v] + kStep * (noise_share * bend +
                                                      (1 - noise_share) * (sampled[v] - before[v]));
          }
        }));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
