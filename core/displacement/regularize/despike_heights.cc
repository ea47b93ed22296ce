#include "core/displacement/regularize/despike_heights.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;
constexpr int kMostRing = 64;
// Fewer pairs of opposite neighbours decide nothing unless the points contradict the height.
constexpr int kLeastPairs = 2;
constexpr float kRingDepartures = 4.0f;
constexpr float kDeviations = 4.0f;
constexpr float kSpacings = 0.25f;
constexpr float kCreaseSpacings = 0.75f;  // the same where a crease told the height

struct Departure {
  float height = 0;  // of the vertex over `expected`
  float expected = 0;
  bool known = false;
};

// The neighbour of `at` opposite to its neighbour `from`.
int Beyond(const LevelRings& rings, int at, int from) {
  const Ring ring = rings.Of(at);
  int place = 0;
  while (ring[place] != from) ++place;
  return ring[(place + ring.size() / 2) % ring.size()];
}

Departure DepartureOf(const MeshTopology& finest, const LevelRings& rings,
                      const HeightSamples& samples, int vertex) {
  Departure least;
  const Ring ring = rings.Of(vertex);
  const int valence = ring.size();
  int pairs = 0;
  // `a` and `b` with their weights tell what to expect.
  const auto depart_from = [&](int a, float weight_a, int b, float weight_b) {
    if (!samples.measured[a] || !samples.measured[b]) return;
    const float expected = weight_a * samples.height[a] + weight_b * samples.height[b];
    const float height = samples.height[vertex] - expected;
    if (pairs++ == 0 || std::abs(height) < std::abs(least.height)) {
      least.height = height;
      least.expected = expected;
    }
  };
  if (finest.boundary_vertex[vertex]) {
    depart_from(ring[0], 0.5f, ring[valence - 1], 0.5f);
    for (int i = 1; i < valence - 1; ++i) {
      const int inner = ring[i];
      if (finest.boundary_vertex[inner]) continue;
      depart_from(inner, 2, Beyond(rings, inner, vertex), -1);
    }
  } else {
    const int half = valence / 2;
    for (int i = 0; i < (valence + 1) / 2; ++i) {
      depart_from(ring[i], 0.5f, ring[(i + half) % valence], 0.5f);
    }
  }
  least.known = pairs >= kLeastPairs;
  return least;
}

// Median over the measured neighbours of what may be expected of a departure there. The vertex's
// own deviation is no excuse: a poor fit is what makes a spike.
float RingTolerance(const LevelRings& rings, const HeightSamples& samples,
                    const std::vector<float>& departures, int64_t vertex) {
  std::array<float, kMostRing> values;
  int count = 0;
  for (const int neighbor : rings.Of(static_cast<int>(vertex))) {
    if (!samples.measured[neighbor] || count == kMostRing) continue;
    values[count++] = kRingDepartures * std::abs(departures[neighbor]) +
                      kDeviations * samples.deviation[neighbor];
  }
  std::nth_element(values.begin(), values.begin() + count / 2, values.begin() + count);
  return count == 0 ? 0.0f : values[count / 2];
}

}  // namespace

absl::StatusOr<std::vector<Spike>> FindSpikes(const MeshTopology& finest, const LevelRings& rings,
                                              const HeightSamples& samples,
                                              ContradictedByPoints contradicted,
                                              const RunContext& context) {
  if (IsLeftOut(Mechanism::kDespike)) return std::vector<Spike>();
  const int count = samples.size();
  std::vector<float> departures(count, 0.0f);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      if (!samples.measured[v]) continue;
      departures[v] = DepartureOf(finest, rings, samples, static_cast<int>(v)).height;
    }
  }));
  std::vector<std::vector<Spike>> blocks(static_cast<size_t>((count + kBlock - 1) / kBlock));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      const float own = std::abs(departures[v]);
      if (!samples.measured[v] || own <= kSpacings * samples.spacing[v]) continue;
      const int vertex = static_cast<int>(v);
      const Departure departure = DepartureOf(finest, rings, samples, vertex);
      const float least = (samples.crease[v] ? kCreaseSpacings : kSpacings) * samples.spacing[v];
      const float most = std::max(least, RingTolerance(rings, samples, departures, v));
      if (!(most > 0)) continue;
      if ((departure.known && own > most) || contradicted(vertex)) {
        blocks[begin / kBlock].push_back({vertex, departure.expected, most});
      }
    }
  }));
  std::vector<Spike> spikes;
  for (const std::vector<Spike>& block : blocks) {
    spikes.insert(spikes.end(), block.begin(), block.end());
  }
  return spikes;
}

}  // namespace rilievo
