#include "core/booleans/grid_predicates.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

using Wide = __int128;
using UnsignedWide = unsigned __int128;
using Row = std::array<int64_t, 3>;

// 24 bits for each axis, of a permutation of 64 bits (D. Lea and G. Steele's SplitMix, 2014).
Row DirectionOf(uint32_t id) {
  Row direction;
  for (size_t axis = 0; axis < 3; ++axis) {
    uint64_t z = (3 * uint64_t{id} + axis + 1) * 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    direction[axis] = static_cast<int64_t>((z ^ (z >> 31)) >> 40) - (1 << 23);
  }
  return direction;
}

Row Difference(const Row& a, const Row& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// Of components up to 2^40: below 2^123.
Wide Determinant(const Row& a, const Row& b, const Row& c) {
  const auto minor = [&](size_t i, size_t j) { return Wide{b[i]} * c[j] - Wide{b[j]} * c[i]; };
  return a[0] * minor(1, 2) - a[1] * minor(0, 2) + a[2] * minor(0, 1);
}

// Six times the volume of the tetrahedron, by power of e.
std::array<Wide, 4> VolumesOf(const GridTriangle& triangle, const GridPoint& point) {
  const GridPoint* corners[3] = {&triangle[1], &triangle[2], &point};
  const Row origin = DirectionOf(triangle[0].id);
  Row r[3], s[3];
  for (size_t i = 0; i < 3; ++i) {
    r[i] = Difference(corners[i]->at, triangle[0].at);
    s[i] = Difference(DirectionOf(corners[i]->id), origin);
  }
  return {
      Determinant(r[0], r[1], r[2]),
      Determinant(s[0], r[1], r[2]) + Determinant(r[0], s[1], r[2]) + Determinant(r[0], r[1], s[2]),
      Determinant(r[0], s[1], s[2]) + Determinant(s[0], r[1], s[2]) + Determinant(s[0], s[1], r[2]),
      Determinant(s[0], s[1], s[2])};
}

int SignOf(const std::array<Wide, 4>& volumes) {
  for (const Wide volume : volumes) {
    if (volume != 0) return volume > 0 ? 1 : -1;
  }
  return 1;
}

// A sum of products of wide integers, in two's complement.
class Sum256 {
 public:
  void AddProduct(Wide a, Wide b) {
    constexpr UnsignedWide kLow = ~uint64_t{0};
    const UnsignedWide x = Magnitude(a), y = Magnitude(b);
    const UnsignedWide low = (x & kLow) * (y & kLow), high = (x >> 64) * (y >> 64);
    const UnsignedWide left = (x >> 64) * (y & kLow), right = (x & kLow) * (y >> 64);
    const UnsignedWide middle = (low >> 64) + (left & kLow) + (right & kLow);
    UnsignedWide product[2] = {(middle << 64) | (low & kLow),
                               high + (left >> 64) + (right >> 64) + (middle >> 64)};
    if ((a < 0) != (b < 0)) {
      product[0] = ~product[0] + 1;
      product[1] = ~product[1] + (product[0] == 0 ? 1 : 0);
    }
    low_ += product[0];
    high_ += product[1] + (low_ < product[0] ? 1 : 0);
  }
  int Sign() const {
    if (low_ == 0 && high_ == 0) return 0;
    return static_cast<Wide>(high_) < 0 ? -1 : 1;
  }

 private:
  static UnsignedWide Magnitude(Wide value) {
    return value < 0 ? -static_cast<UnsignedWide>(value) : static_cast<UnsignedWide>(value);
  }
  UnsignedWide low_ = 0, high_ = 0;
};

}  // namespace

int SideOf(const GridTriangle& triangle, const GridPoint& point) {
  const Eigen::Vector3d origin = triangle[0].position();  // differences of doubles are exact here
  const Eigen::Vector3d u = triangle[1].position() - origin, v = triangle[2].position() - origin,
                        w = point.position() - origin;
  const double yz = u.y() * v.z(), zy = u.z() * v.y(), zx = u.z() * v.x(), xz = u.x() * v.z(),
               xy = u.x() * v.y(), yx = u.y() * v.x();
  const double volume = (yz - zy) * w.x() + (zx - xz) * w.y() + (xy - yx) * w.z();
  const double size = (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) +
                      (std::abs(zx) + std::abs(xz)) * std::abs(w.y()) +
                      (std::abs(xy) + std::abs(yx)) * std::abs(w.z());
  // J. Shewchuk, "Adaptive Precision Floating-Point Arithmetic", 1997: 7 rounding errors at most.
  if (std::abs(volume) > 1e-15 * size) return volume > 0 ? 1 : -1;
  return SignOf(VolumesOf(triangle, point));
}

bool Meets(const GridPoint& p, const GridPoint& q, const GridTriangle& triangle) {
  if (SideOf(triangle, p) == SideOf(triangle, q)) return false;
  const auto turn = [&](size_t a, size_t b) { return SideOf({p, q, triangle[a]}, triangle[b]); };
  const int first = turn(0, 1);
  return turn(1, 2) == first && turn(2, 0) == first;
}

EdgeCrossing::EdgeCrossing(const GridPoint& p, const GridPoint& q, const GridTriangle& triangle)
    : to_p_(VolumesOf(triangle, p)), to_q_(VolumesOf(triangle, q)) {
  if (SignOf(to_p_) < 0) {
    for (Wide& volume : to_p_) volume = -volume;
  } else {
    for (Wide& volume : to_q_) volume = -volume;
  }
  size_t power = 0;
  while (power < 3 && to_p_[power] == 0 && to_q_[power] == 0) ++power;
  const double part = static_cast<double>(to_p_[power]);
  const double whole = part + static_cast<double>(to_q_[power]);
  parameter_ = whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0.5;
}

bool EdgeCrossing::Before(const EdgeCrossing& other) const {
  if (std::abs(parameter_ - other.parameter_) > 1e-12) return parameter_ < other.parameter_;
  for (size_t power = 0; power < 7; ++power) {
    Sum256 sum;
    for (size_t i = power > 3 ? power - 3 : 0; i <= std::min<size_t>(power, 3); ++i) {
      sum.AddProduct(to_p_[i], other.to_q_[power - i]);
      sum.AddProduct(-other.to_p_[i], to_q_[power - i]);
    }
    if (sum.Sign() != 0) return sum.Sign() < 0;
  }
  return false;
}

}  // namespace rilievo
