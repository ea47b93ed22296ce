#include "core/evaluate/quartic_patch.h"

#include <initializer_list>

namespace rilievo {
namespace {

constexpr int kDegree = 4, kPowers = 15;
using Powers = std::array<double, kPowers>;  // of u^i v^j, as in QuarticPatch

int PlaceOf(int i, int j) { return j * (kDegree + 1) - j * (j - 1) / 2 + i; }

// count a^p b^q c^r, the weights of a corner, of the next and of the one after it.
struct Term {
  double count;
  int a, b, c;
};

// Multiplies by weight `which` of corners 0, 1, 2: 1 - u - v, u, v.
Powers Times(const Powers& powers, int which) {
  Powers product{};
  for (int j = 0; j <= kDegree; ++j) {
    for (int i = 0; i + j <= kDegree; ++i) {
      const double value = powers[PlaceOf(i, j)];
      if (value == 0) continue;
      if (which == 1) {
        product[PlaceOf(i + 1, j)] += value;
      } else if (which == 2) {
        product[PlaceOf(i, j + 1)] += value;
      } else {
        product[PlaceOf(i, j)] += value;
        product[PlaceOf(i + 1, j)] -= value;
        product[PlaceOf(i, j + 1)] -= value;
      }
    }
  }
  return product;
}

// The sum of terms of degree 4 around `corner`, divided by 12.
Powers Expand(std::initializer_list<Term> terms, int corner) {
  Powers sum{};
  for (const Term& term : terms) {
    Powers powers{};
    powers[0] = term.count / 12;
    for (int i = 0; i < term.a; ++i) powers = Times(powers, corner);
    for (int i = 0; i < term.b; ++i) powers = Times(powers, (corner + 1) % 3);
    for (int i = 0; i < term.c; ++i) powers = Times(powers, (corner + 2) % 3);
    for (int p = 0; p < kPowers; ++p) sum[p] += powers[p];
  }
  return sum;
}

// The basis functions of a RegularRing. Outer points of a corner: the one beside the corner before
// it, the one beside the next corner, the one opposite the edge to the next corner.
std::array<Powers, 12> MakeBasis() {
  std::array<Powers, 12> basis;
  for (int k = 0; k < 3; ++k) {
    basis[k] = Expand({{6, 4, 0, 0},
                       {24, 3, 0, 1},
                       {24, 2, 0, 2},
                       {8, 1, 0, 3},
                       {1, 0, 0, 4},
                       {24, 3, 1, 0},
                       {60, 2, 1, 1},
                       {36, 1, 1, 2},
                       {6, 0, 1, 3},
                       {24, 2, 2, 0},
                       {36, 1, 2, 1},
                       {12, 0, 2, 2},
                       {8, 1, 3, 0},
                       {6, 0, 3, 1},
                       {1, 0, 4, 0}},
                      k);
    basis[3 + 3 * k] = Expand({{1, 4, 0, 0}, {2, 3, 0, 1}}, k);
    basis[4 + 3 * k] = Expand({{1, 4, 0, 0}, {2, 3, 1, 0}}, k);
    basis[5 + 3 * k] = Expand({{1, 4, 0, 0},
                               {2, 3, 0, 1},
                               {6, 3, 1, 0},
                               {6, 2, 1, 1},
                               {12, 2, 2, 0},
                               {6, 1, 2, 1},
                               {6, 1, 3, 0},
                               {2, 0, 3, 1},
                               {1, 0, 4, 0}},
                              k);
  }
  return basis;
}

}  // namespace

QuarticPatch QuarticPatch::Over(const RegularRing& ring) {
  static const std::array<Powers, 12> basis = MakeBasis();
  QuarticPatch patch;
  for (int p = 0; p < kPowers; ++p) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < 12; ++i) sum += basis[i][p] * ring[i];
    Eigen::Map<Eigen::Vector3d>(&patch.coefficients_[3 * p]) = sum;
  }
  return patch;
}

void QuarticPatch::Evaluate(double u, double v, JetOrder order, SurfaceJet& jet) const {
  switch (order) {
    case JetOrder::kPosition:
      return Evaluate<JetOrder::kPosition>(u, v, jet);
    case JetOrder::kFirst:
      return Evaluate<JetOrder::kFirst>(u, v, jet);
    case JetOrder::kSecond:
      return Evaluate<JetOrder::kSecond>(u, v, jet);
  }
}

}  // namespace rilievo
