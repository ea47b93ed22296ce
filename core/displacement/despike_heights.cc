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
// Fewer pairs of opposite neighbours say nothing.
constexpr int kLeastPairs = 2;
constexpr float kRingDepartures = 4.0f;
constexpr float kDeviations = 5.0f;
constexpr float kSpacings = 0.5f;
constexpr float kCreaseSpacings = 1.5f;  // the same where a crease told the height

struct Departure {
  float height = 0;  // of the vertex over `expected`
  float expected = 0;
  bool known = false;
};

Departure DepartureOf(const VertexRings& rings, const HeightSamples& samples, int64_t vertex) {
  Departure least;
  const int begin = rings.neighbor_begin[vertex];
  const int valence = rings.neighbor_begin[vertex + 1] - begin;
  const int half = valence / 2;
  int pairs = 0;
  for (int i = 0; half > 0 && i < (valence + 1) / 2; ++i) {
    const int a = rings.neighbors[begin + i], b = rings.neighbors[begin + (i + half) % valence];
    if (!samples.measured[a] || !samples.measured[b]) continue;
    const float expected = 0.5f * (samples.height[a] + samples.height[b]);
    const float height = samples.height[vertex] - expected;
    if (pairs++ == 0 || std::abs(height) < std::abs(least.height)) {
      least.height = height;
      least.expected = expected;
    }
  }
  least.known = pairs >= kLeastPairs;
  return least;
}

// Median over the measured neighbours of what may be expected of a departure there. The vertex's
// own deviation is no excuse: a poor fit is what makes a spike.
float RingTolerance(const VertexRings& rings, const HeightSamples& samples,
                    const std::vector<Departure>& departures, int64_t vertex) {
  std::array<float, kMostRing> values;
  int count = 0;
  for (int r = rings.neighbor_begin[vertex]; r < rings.neighbor_begin[vertex + 1]; ++r) {
    const int neighbor = rings.neighbors[r];
    if (!samples.measured[neighbor] || count == kMostRing) continue;
    values[count++] = kRingDepartures * std::abs(departures[neighbor].height) +
                      kDeviations * samples.deviation[neighbor];
  }
  std::nth_element(values.begin(), values.begin() + count / 2, values.begin() + count);
  return count == 0 ? 0.0f : values[count / 2];
}

}  // namespace

absl::StatusOr<std::vector<Spike>> FindSpikes(const VertexRings& rings,
                                              const HeightSamples& samples,
                                              const RunContext& context) {
  const int count = samples.size();
  std::vector<Departure> departures(count);
  std::vector<float> tolerance(count, 0.0f);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      if (samples.measured[v]) departures[v] = DepartureOf(rings, samples, v);
    }
  }));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      const float least = (samples.crease[v] ? kCreaseSpacings : kSpacings) * samples.spacing[v];
      const float own = std::abs(departures[v].height);
      if (!departures[v].known || own <= least) continue;
      const float most = std::max(least, RingTolerance(rings, samples, departures, v));
      if (own > most) tolerance[v] = most;
    }
  }));
  std::vector<Spike> spikes;
  for (int v = 0; v < count; ++v) {
    if (tolerance[v] > 0) spikes.push_back({v, departures[v].expected, tolerance[v]});
  }
  return spikes;
}

}  // namespace rilievo
