#include "core/loop/crease_masks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry/triangle_mesh.h"
#include "core/loop/loop_masks.h"
#include "core/loop/sharp_ring.h"

namespace rilievo {
namespace {

using Weights = std::vector<double>;  // of the vertex itself and of its neighbours

// Neighbour i of a closed ring, i >= 0, as index of Weights.
int Entry(const SharpRing& ring, int i) { return 1 + i % Valence(ring); }

Weights SmoothVertexWeights(const SharpRing& ring) {
  const int valence = Valence(ring);
  const double beta = valence == 6 ? 1.0 / 16.0 : LoopBeta(valence);
  Weights weights(valence + 1, beta);
  weights[0] = 1.0 - valence * beta;
  return weights;
}

// row * M, M the subdivision matrix of the vertex and its ring.
Weights TimesSubdivisionMatrix(const SharpRing& ring, const Weights& row) {
  const int valence = Valence(ring);
  Weights product = SharpVertexWeights(ring);
  for (double& weight : product) weight *= row[0];
  for (int i = 0; i < valence; ++i) {
    const double crease = std::min(ring.sharpness[i], 1.0f);
    const double end = row[1 + i] * (0.375 + 0.125 * crease);
    product[0] += end;
    product[1 + i] += end;
    if (crease == 1.0) continue;
    const double opposite = row[1 + i] * 0.125 * (1.0 - crease);
    product[Entry(ring, i + 1)] += opposite;
    product[Entry(ring, i + valence - 1)] += opposite;
  }
  return product;
}

// cosh(x) / cosh(y), |x| <= y, without overflow.
double CoshRatio(double x, double y) {
  x = std::abs(x);
  return std::exp(x - y) * (1.0 + std::exp(-2.0 * x)) / (1.0 + std::exp(-2.0 * y));
}

Weights DartPosition(const SharpRing& ring, int spoke) {
  const int valence = Valence(ring);
  const double beta = LoopBeta(valence), phi = std::acosh(2.5);
  Weights weights(valence + 1, 1.0);
  double sum = 1.0;
  for (int i = 1; i < valence; ++i) {
    const double ratio = CoshRatio((i - 0.5 * valence) * phi, 0.5 * valence * phi);
    sum += weights[Entry(ring, spoke + i)] = 8.0 / 3.0 * beta * (1.0 - ratio);
  }
  sum += weights[1 + spoke] = 2.0 * beta + 0.5 * weights[Entry(ring, spoke + 1)];
  for (double& weight : weights) weight /= sum;
  return weights;
}

// The symmetric left eigenvector l of the dart's matrix with eigenvalue L = 3/8 + cos(theta)/4: by
// the columns of inner neighbours l_i = cos((i - n/2) theta) + B, B = -cos(n theta/2), because p_0
// hands nothing on to them, and beta l_v = B (L - 5/8).
struct DartMode {
  double eigenvalue, self, sharp_end;
  double secular;  // what the column of p_0 lacks; zero at an eigenvalue
};

DartMode DartModeAt(int valence, double theta) {
  const double beta = LoopBeta(valence);
  const double offset = -std::cos(0.5 * valence * theta);
  const double inner_sum =
      std::sin(0.5 * (valence - 1) * theta) / std::sin(0.5 * theta) + (valence - 1) * offset;
  const double next = std::cos((1.0 - 0.5 * valence) * theta) + offset;
  DartMode mode;
  mode.eigenvalue = 0.375 + 0.25 * std::cos(theta);
  mode.self = offset * (mode.eigenvalue - 0.625) / beta;
  // Column of the vertex: L l_v = (1 - n beta) l_v + l_0 / 2 + 3/8 sum l_i.
  mode.sharp_end = 2.0 * ((mode.eigenvalue - 1.0 + valence * beta) * mode.self - 0.375 * inner_sum);
  // Column of p_0: L l_0 = beta l_v + l_0 / 2 + (l_1 + l_{n-1}) / 8.
  mode.secular = (mode.eigenvalue - 0.5) * mode.sharp_end - beta * mode.self - 0.25 * next;
  return mode;
}

// Bisection: between 1.2 and 2.9 times pi / n the secular function changes sign once, at the
// subdominant eigenvalue; crease_masks_test.cc compares with a general eigensolver.
double DartAngle(int valence) {
  double low = 1.2 * std::numbers::pi / valence;
  double high = std::min(2.9 * std::numbers::pi / valence, 0.999 * std::numbers::pi);
  const bool rises = DartModeAt(valence, low).secular < 0.0;
  for (int step = 0; step < 64; ++step) {
    const double middle = 0.5 * (low + high);
    if ((DartModeAt(valence, middle).secular < 0.0) == rises) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return 0.5 * (low + high);
}

SharpSector DartSector(const SharpRing& ring, int spoke) {
  const int valence = Valence(ring);
  const double theta = DartAngle(valence);
  const DartMode mode = DartModeAt(valence, theta);
  SharpSector sector = {spoke, valence, Weights(valence + 1, 0.0), Weights(valence + 1, 0.0)};
  sector.tangent_u[0] = -mode.self;
  sector.tangent_u[1 + spoke] = -mode.sharp_end;
  for (int i = 1; i < valence; ++i) {
    const int entry = Entry(ring, spoke + i);
    sector.tangent_u[entry] =
        std::cos(0.5 * valence * theta) - std::cos((i - 0.5 * valence) * theta);
    sector.tangent_v[entry] = std::sin(2.0 * std::numbers::pi * i / valence);
  }
  return sector;
}

// The mask of a whole ring as weights with the vertex itself in front.
Weights WithSelf(double self, const std::vector<double>& neighbors) {
  Weights weights = {self};
  weights.insert(weights.end(), neighbors.begin(), neighbors.end());
  return weights;
}

// The whole ring by the smooth rules.
SharpSector WholeSector(const SharpRing& ring) {
  const int valence = Valence(ring);
  const LoopLimitMask mask =
      ring.boundary ? BoundaryLimitMask(valence) : InteriorLimitMask(valence);
  return {0, ring.boundary ? valence - 1 : valence, WithSelf(mask.tangent_u_self, mask.tangent_u),
          WithSelf(mask.tangent_v_self, mask.tangent_v)};
}

SharpSector CreaseSector(const SharpRing& ring, int first, int face_count) {
  const LoopLimitMask mask = BoundaryLimitMask(face_count + 1);
  SharpSector sector = {first, face_count, Weights(Valence(ring) + 1, 0.0),
                        Weights(Valence(ring) + 1, 0.0)};
  sector.tangent_u[0] = mask.tangent_u_self;
  sector.tangent_v[0] = mask.tangent_v_self;
  for (int i = 0; i <= face_count; ++i) {
    sector.tangent_u[Entry(ring, first + i)] = mask.tangent_u[i];
    sector.tangent_v[Entry(ring, first + i)] = mask.tangent_v[i];
  }
  return sector;
}

SharpSector CornerSector(const SharpRing& ring, int first, int face_count) {
  SharpSector sector = {first, face_count, Weights(Valence(ring) + 1, 0.0),
                        Weights(Valence(ring) + 1, 0.0)};
  const int a = Entry(ring, first), b = Entry(ring, first + face_count);
  sector.tangent_u[a] = 1.0;
  sector.tangent_u[b] = -1.0;
  if (face_count == 1) {
    sector.tangent_v[0] = -2.0;
    sector.tangent_v[a] = sector.tangent_v[b] = 1.0;
    return sector;
  }
  for (int i = 1; i < face_count; ++i) {
    const double weight = std::sin(i * std::numbers::pi / face_count);
    sector.tangent_v[Entry(ring, first + i)] = weight;
    sector.tangent_v[0] -= weight;
  }
  return sector;
}

// All edges smooth or sharp for ever.
SharpLimitMask LimitOfSettledRing(const SharpRing& ring) {
  const std::vector<int> spokes = SharpSpokes(ring);
  switch (KindOf(ring, spokes)) {
    case VertexKind::kSmooth: {
      const LoopLimitMask mask = InteriorLimitMask(Valence(ring));
      return {WithSelf(mask.position_self, mask.position), {WholeSector(ring)}, {}};
    }
    case VertexKind::kDart:
      return {DartPosition(ring, spokes[0]), {DartSector(ring, spokes[0])}, {}};
    case VertexKind::kCrease:
      return {Spread(Valence(ring) + 1, 2.0 / 3.0, 1.0 / 6.0, spokes),
              SectorsBetween(ring, spokes, CreaseSector),
              {}};
    case VertexKind::kCorner:
      break;
  }
  const Weights position = Spread(Valence(ring) + 1, 1.0, 0.0, {});
  if (spokes.size() < 2) return {position, {WholeSector(ring)}, {}};
  return {position, SectorsBetween(ring, spokes, CornerSector), {}};
}

}  // namespace

float SharpnessOfHalves(float sharpness) {
  if (sharpness >= kInfiniteSharpness) return kInfiniteSharpness;
  return std::max(sharpness - 1.0f, 0.0f);
}

std::vector<double> SharpVertexWeights(const SharpRing& ring) {
  return VertexWeightsBy(ring, ring.sharpness.size() + 1,
                         [&] { return SmoothVertexWeights(ring); });
}

SharpLimitMask SharpLimit(const SharpRing& ring) {
  SharpLimitMask mask = LimitBy(ring, LimitOfSettledRing, TimesSubdivisionMatrix);
  mask.whole = mask.sectors.size() == 1 ? mask.sectors.front() : WholeSector(ring);
  return mask;
}

}  // namespace rilievo
