#include "core/displacement/input_laplacian.h"

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;
constexpr float kStep = 0.5f;

}  // namespace

absl::Status SmoothHeights(const VertexRings& rings, int rounds, const RunContext& context,
                           HeightSamples* samples) {
  const std::vector<float> sampled = samples->height;
  std::vector<float> before;
  for (int round = 0; round < rounds; ++round) {
    before = samples->height;
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(samples->size(), kBlock, context, [&](int64_t begin, int64_t end) {
          for (int64_t v = begin; v < end; ++v) {
            if (!samples->measured[v]) continue;
            float sum = 0;
            int count = 0;
            for (int r = rings.neighbor_begin[v]; r < rings.neighbor_begin[v + 1]; ++r) {
              const int neighbor = rings.neighbors[r];
              if (!samples->measured[neighbor]) continue;
              sum += before[neighbor];
              ++count;
            }
            // A one-sided mean would pull the rim along the slope of the relief.
            if (count < rings.neighbor_begin[v + 1] - rings.neighbor_begin[v]) continue;
            const float bend = sum / static_cast<float>(count) - before[v];
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
