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
constexpr float kSpacings = 0.25f;
constexpr float kCreaseSpacings = 0.75f;  // the same where a crease told the height

struct Departure {
  float height = 0;  // of the vertex over `expected`
  float expected = 0;
  bool known = false;
};

// The neighbour of `at` opposite to its neighbour `from`.
int Beyond(const VertexRings& rings, int at, int from) {
  const int begin = rings.neighbor_begin[at];
  const int valence = rings.neighbor_begin[at + 1] - begin;
  int place = 0;
  while (rings.neighbors[begin + place] != from) ++place;
  return rings.neighbors[begin + (place + valence / 2) % valence];
}

Departure DepartureOf(const MeshTopology& finest, const VertexRings& rings,
                      const HeightSamples& samples, int vertex) {
  Departure least;
  const int begin = rings.neighbor_begin[vertex];
  const int valence = rings.neighbor_begin[vertex + 1] - begin;
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
    depart_from(rings.neighbors[begin], 0.5f, rings.neighbors[begin + valence - 1], 0.5f);
    for (int i = 1; i < valence - 1; ++i) {
      const int inner = rings.neighbors[begin + i];
      if (finest.boundary_vertex[inner]) continue;
      depart_from(inner, 2, Beyond(rings, inner, vertex), -1);
    }
  } else {
    const int half = valence / 2;
    for (int i = 0; i < (valence + 1) / 2; ++i) {
      depart_from(rings.neighbors[begin + i], 0.5f, rings.neighbors[begin + (i + half) % valence],
                  0.5f);
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

absl::StatusOr<std::vector<Spike>> FindSpikes(const MeshTopology& finest, const VertexRings& rings,
                                              const HeightSamples& samples,
                                              const RunContext& context) {
  const int count = samples.size();
  std::vector<Departure> departures(count);
  std::vector<float> tolerance(count, 0.0f);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      if (samples.measured[v])
        departures[v] = DepartureOf(finest, rings, samples, static_cast<int>(v));
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
