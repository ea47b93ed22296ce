#include "core/displacement/despike_heights.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;
constexpr int kMostRing = 64;
// A median over fewer neighbours says nothing.
constexpr int kLeastRing = 3;
constexpr float kRingDepartures = 4.0f;
constexpr float kDeviations = 5.0f;
constexpr float kSpacings = 0.5f;

// Median of `value` over the measured neighbours; false when there are too few.
template <typename Value>
bool RingMedian(const VertexRings& rings, const HeightSamples& samples, int64_t vertex,
                const Value& value, float* median) {
  std::array<float, kMostRing> values;
  int count = 0;
  for (int r = rings.neighbor_begin[vertex]; r < rings.neighbor_begin[vertex + 1]; ++r) {
    const int neighbor = rings.neighbors[r];
    if (samples.measured[neighbor] && count < kMostRing) values[count++] = value(neighbor);
  }
  if (count < kLeastRing) return false;
  std::nth_element(values.begin(), values.begin() + count / 2, values.begin() + count);
  *median = values[count / 2];
  return true;
}

}  // namespace

absl::StatusOr<std::vector<Spike>> FindSpikes(const VertexRings& rings,
                                              const HeightSamples& samples,
                                              const RunContext& context) {
  const int count = samples.size();
  std::vector<float> departure(count, 0.0f), tolerance(count, 0.0f);
  std::vector<uint8_t> is_spike(count, 0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      float median = 0;
      if (!samples.measured[v]) continue;
      if (!RingMedian(
              rings, samples, v, [&](int w) { return samples.height[w]; }, &median))
        continue;
      departure[v] = samples.height[v] - median;
    }
  }));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      const float own = std::abs(departure[v]);
      if (own <= kSpacings * samples.spacing[v]) continue;
      float around = 0;
      if (!RingMedian(
              rings, samples, v, [&](int w) { return std::abs(departure[w]); }, &around)) {
        continue;
      }
      tolerance[v] = std::max(kSpacings * samples.spacing[v],
                              kRingDepartures * around + kDeviations * samples.deviation[v]);
      is_spike[v] = own > tolerance[v];
    }
  }));
  std::vector<Spike> spikes;
  for (int v = 0; v < count; ++v) {
    if (is_spike[v]) spikes.push_back({v, samples.height[v] - departure[v], tolerance[v]});
  }
  return spikes;
}

}  // namespace rilievo
