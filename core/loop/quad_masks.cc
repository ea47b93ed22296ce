#include "core/loop/quad_masks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/loop/sharp_ring.h"

namespace rilievo {
namespace {

using QuadWeights = std::vector<double>;

// The weight of the neighbours along edges beside that of the opposite corners, in the eigenvector
// of this angle.
double EdgeToCornerRatio(double angle) {
  const double c = std::cos(angle);
  return 1.0 + c + std::sqrt((9.0 + c) * (1.0 + c));
}

int QuadCount(const SharpRing& ring) { return Valence(ring) - (ring.boundary ? 1 : 0); }
size_t Entries(const SharpRing& ring) {
  return static_cast<size_t>(1 + Valence(ring) + QuadCount(ring));
}

// Neighbour i along an edge and corner i opposite, i >= 0, as index of weights.
int EdgeEntry(const SharpRing& ring, int i) { return 1 + i % Valence(ring); }
int CornerEntry(const SharpRing& ring, int i) { return 1 + Valence(ring) + i % QuadCount(ring); }

QuadWeights SmoothQuadWeights(const SharpRing& ring) {
  const double n = Valence(ring);
  QuadWeights weights(Entries(ring), 1.0 / (4.0 * n * n));
  weights[0] = 1.0 - 7.0 / (4.0 * n);
  std::fill_n(weights.begin() + 1, Valence(ring), 3.0 / (2.0 * n * n));
  return weights;
}

// row * M, M the subdivision matrix of the vertex and its ring.
QuadWeights TimesQuadMatrix(const SharpRing& ring, const QuadWeights& row) {
  const int valence = Valence(ring);
  QuadWeights product = QuadVertexWeights(ring);
  for (double& weight : product) weight *= row[0];
  for (int i = 0; i < valence; ++i) {
    const double crease = std::min(ring.sharpness[i], 1.0f);
    const double end = row[1 + i] * (0.375 + 0.125 * crease);
    product[0] += end;
    product[1 + i] += end;
    if (crease == 1.0) continue;
    const double other = row[1 + i] * 0.0625 * (1.0 - crease);
    for (const int beside : {i + 1, i + valence - 1}) product[EdgeEntry(ring, beside)] += other;
    for (const int beside : {i, i + QuadCount(ring) - 1}) {
      product[CornerEntry(ring, beside)] += other;
    }
  }
  for (int j = 0; j < QuadCount(ring); ++j) {
    const double quarter = 0.25 * row[CornerEntry(ring, j)];
    product[0] += quarter;
    product[EdgeEntry(ring, j)] += quarter;
    product[EdgeEntry(ring, j + 1)] += quarter;
    product[CornerEntry(ring, j)] += quarter;
  }
  return product;
}

// The mode value(i) over the edges of a smooth ring, counted from edge `first`.
template <typename Value>
QuadWeights SmoothMode(const SharpRing& ring, int first, const Value& value) {
  const int valence = Valence(ring);
  const double ratio = EdgeToCornerRatio(2.0 * std::numbers::pi / valence);
  QuadWeights weights(Entries(ring), 0.0);
  for (int i = 0; i < valence; ++i) {
    const double here = value(2.0 * std::numbers::pi * i / valence);
    weights[EdgeEntry(ring, first + i)] = ratio * here;
    weights[CornerEntry(ring, first + i)] =
        here + value(2.0 * std::numbers::pi * (i + 1) / valence);
  }
  return weights;
}

SharpSector SmoothSector(const SharpRing& ring, int first) {
  const auto cosine = [](double angle) { return std::cos(angle); };
  const auto sine = [](double angle) { return std::sin(angle); };
  return {first, Valence(ring), SmoothMode(ring, first, cosine), SmoothMode(ring, first, sine)};
}

QuadWeights SmoothQuadPosition(const SharpRing& ring) {
  const double n = Valence(ring);
  QuadWeights weights(Entries(ring), 1.0 / (n * (n + 5.0)));
  weights[0] = n / (n + 5.0);
  std::fill_n(weights.begin() + 1, Valence(ring), 4.0 / (n * (n + 5.0)));
  return weights;
}

// The inner edges and the corners of a side by the mode sin(i pi / k).
QuadWeights ModeAcross(const SharpRing& ring, int first, int quads) {
  const double angle = std::numbers::pi / quads, ratio = EdgeToCornerRatio(angle);
  QuadWeights weights(Entries(ring), 0.0);
  const auto sine = [&](int i) { return i == 0 || i == quads ? 0.0 : std::sin(i * angle); };
  for (int i = 0; i < quads; ++i) {
    if (i > 0) weights[EdgeEntry(ring, first + i)] = ratio * sine(i);
    weights[CornerEntry(ring, first + i)] = sine(i) + sine(i + 1);
  }
  return weights;
}

// A side with the tangent along its sharp edges alone, but for a single quad.
SharpSector SectorWithoutCrossTangent(const SharpRing& ring, int first, int quads) {
  SharpSector sector = {first, quads, QuadWeights(Entries(ring), 0.0),
                        QuadWeights(Entries(ring), 0.0)};
  sector.tangent_u[EdgeEntry(ring, first)] = 1.0;
  sector.tangent_u[EdgeEntry(ring, first + quads)] = -1.0;
  if (quads == 1) {
    sector.tangent_v[0] = -3.0;
    for (const int end : {first, first + 1}) sector.tangent_v[EdgeEntry(ring, end)] = 1.0;
    sector.tangent_v[CornerEntry(ring, first)] = 1.0;
  }
  return sector;
}

SharpSector QuadCreaseSector(const SharpRing& ring, int first, int quads) {
  SharpSector sector = SectorWithoutCrossTangent(ring, first, quads);
  if (quads == 1) return sector;
  sector.tangent_v = ModeAcross(ring, first, quads);
  const double angle = std::numbers::pi / quads, ratio = EdgeToCornerRatio(angle);
  const double eigenvalue = (ratio + 4.0) / 16.0;
  const double sum = 1.0 / std::tan(0.5 * angle);
  const double inner = sum * (3.0 * ratio + 4.0) / 8.0;
  const double self = ((eigenvalue - 0.5) * inner + std::sin(angle) * (ratio + 4.0) / 16.0) /
                      ((eigenvalue - 1.0) * (eigenvalue - 0.25));
  sector.tangent_v[0] = self;
  for (const int end : {first, first + quads}) {
    sector.tangent_v[EdgeEntry(ring, end)] = (eigenvalue - 0.75) * self - inner;
  }
  return sector;
}

SharpSector QuadCornerSector(const SharpRing& ring, int first, int quads) {
  SharpSector sector = SectorWithoutCrossTangent(ring, first, quads);
  if (quads == 1) return sector;
  sector.tangent_v = ModeAcross(ring, first, quads);
  sector.tangent_v[0] = -std::accumulate(sector.tangent_v.begin(), sector.tangent_v.end(), 0.0);
  return sector;
}

double LargestWeight(const QuadWeights& weights) {
  double largest = 0.0;
  for (const double weight : weights) largest = std::max(largest, std::abs(weight));
  return largest;
}

// Applies next() until it changes `row`, whose weights are 1 at most, by rounding alone.
template <typename Next>
QuadWeights Settled(QuadWeights row, const Next& next) {
  constexpr int kMostIterations = 5000;
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  for (int step = 0; step < kMostIterations; ++step) {
    QuadWeights moved = next(row);
    double change = 0.0;
    for (size_t i = 0; i < row.size(); ++i) change = std::max(change, std::abs(moved[i] - row[i]));
    row = std::move(moved);
    if (change <= kRounding) break;
  }
  return row;
}

// Makes a row on a ring symmetric about edge `spoke`.
void MakeSymmetric(const SharpRing& ring, int spoke, QuadWeights& row) {
  const int valence = Valence(ring);
  const auto mean = [&row](int a, int b) { row[a] = row[b] = 0.5 * (row[a] + row[b]); };
  for (int i = 0; 2 * i < valence; ++i) {
    mean(EdgeEntry(ring, spoke + i), EdgeEntry(ring, spoke + valence - i));
    mean(CornerEntry(ring, spoke + i), CornerEntry(ring, spoke + valence - 1 - i));
  }
}

// The symmetric mode is what the iteration leaves of the cosine once the constant is taken out; the
// sine is zero along the sharp edge and so the mode that it is on a smooth ring.
SharpLimitMask DartLimit(const SharpRing& ring, int spoke) {
  SharpLimitMask mask;
  mask.position = Settled(SmoothQuadPosition(ring),
                          [&](const QuadWeights& row) { return TimesQuadMatrix(ring, row); });
  SharpSector sector = SmoothSector(ring, spoke);
  sector.tangent_u = Settled(sector.tangent_u, [&](const QuadWeights& row) {
    QuadWeights next = TimesQuadMatrix(ring, row);
    const double sum = std::accumulate(next.begin(), next.end(), 0.0);
    for (size_t i = 0; i < next.size(); ++i) next[i] -= sum * mask.position[i];
    MakeSymmetric(ring, spoke, next);  // else rounding grows into the sine where that leads
    const double largest = LargestWeight(next);
    if (largest == 0.0) return next;
    for (double& weight : next) weight /= largest;
    return next;
  });
  mask.sectors.push_back(std::move(sector));
  return mask;
}

SharpSector WholeQuadSector(const SharpRing& ring) {
  return ring.boundary ? QuadCreaseSector(ring, 0, QuadCount(ring)) : SmoothSector(ring, 0);
}

SharpLimitMask LimitOfSettledQuads(const SharpRing& ring) {
  const std::vector<int> spokes = SharpSpokes(ring);
  switch (KindOf(ring, spokes)) {
    case VertexKind::kSmooth:
      return {SmoothQuadPosition(ring), {SmoothSector(ring, 0)}, {}};
    case VertexKind::kDart:
      return DartLimit(ring, spokes[0]);
    case VertexKind::kCrease:
      return {Spread(Entries(ring), 2.0 / 3.0, 1.0 / 6.0, spokes),
              SectorsBetween(ring, spokes, QuadCreaseSector),
              {}};
    case VertexKind::kCorner:
      break;
  }
  const QuadWeights position = Spread(Entries(ring), 1.0, 0.0, {});
  if (spokes.size() < 2) return {position, {WholeQuadSector(ring)}, {}};
  return {position, SectorsBetween(ring, spokes, QuadCornerSector), {}};
}

}  // namespace

std::vector<double> QuadVertexWeights(const SharpRing& ring) {
  return VertexWeightsBy(ring, Entries(ring), [&] { return SmoothQuadWeights(ring); });
}

SharpLimitMask QuadLimit(const SharpRing& ring) {
  SharpLimitMask mask = LimitBy(ring, LimitOfSettledQuads, TimesQuadMatrix);
  mask.whole = mask.sectors.size() == 1 ? mask.sectors.front() : WholeQuadSector(ring);
  return mask;
}

}  // namespace rilievo
