#include "core/codec/mesh/gate_geometry.h"

#include <algorithm>
#include <bit>
#include <cstdlib>

namespace rilievo {
namespace {

struct Direction {
  int64_t x, y, z;
};

Direction Difference(const GridPoint& to, const GridPoint& from) {
  return {int64_t{to[0]} - from[0], int64_t{to[1]} - from[1], int64_t{to[2]} - from[2]};
}

int BitsOf(const Direction& d) {
  return std::bit_width(
      static_cast<uint64_t>(std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)})));
}

// Shifted so that the longest coordinate has `bits` bits; shorter vectors gain zeros.
Direction WithBits(const Direction& d, int bits) {
  const int shift = bits - BitsOf(d);
  if (shift >= 0) return {d.x << shift, d.y << shift, d.z << shift};
  return {d.x >> -shift, d.y >> -shift, d.z >> -shift};
}

int64_t Dot(const Direction& a, const Direction& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

int64_t SquareRoot(int64_t value) {
  if (value <= 0) return 0;
  int64_t root = 0;
  for (int bit = (std::bit_width(static_cast<uint64_t>(value)) - 1) / 2; bit >= 0; --bit) {
    const int64_t trial = root | (int64_t{1} << bit);
    if (trial * trial <= value) root = trial;
  }
  return root;
}

}  // namespace

int CornerAngle(const GridPoint& corner, const GridPoint& p, const GridPoint& q) {
  const Direction u = WithBits(Difference(p, corner), 14), v = WithBits(Difference(q, corner), 14);
  const int64_t length = SquareRoot(Dot(u, u)) * SquareRoot(Dot(v, v));
  if (length == 0) return 0;
  const int64_t one = 1 << 14;
  const int64_t cosine = std::clamp(Dot(u, v) * one / length, -one, one);
  // acos x = sqrt(1 - x) (1.5707288 - 0.2121144 x + 0.0742610 x^2 - 0.0187293 x^3) for x >= 0
  // (Abramowitz and Stegun 4.4.45), in 1/2^14.
  const int64_t x = std::abs(cosine);
  int64_t sum = -307;
  sum = 1217 + ((sum * x) >> 14);
  sum = -3475 + ((sum * x) >> 14);
  sum = 25735 + ((sum * x) >> 14);
  const int64_t radians = (SquareRoot((one - x) << 14) * sum) >> 14;
  const int angle = static_cast<int>(radians * 2048 / 51472);  // pi in 1/2^14
  return std::clamp(cosine < 0 ? 2048 - angle : angle, 0, 2048);
}

int RelativeDistance(const GridPoint& p, const GridPoint& q, const GridPoint& a,
                     const GridPoint& b) {
  const Direction d = Difference(p, q), e = Difference(b, a);
  const int shift = std::max(0, std::max(BitsOf(d), BitsOf(e)) - 24);
  const Direction d_short = {d.x >> shift, d.y >> shift, d.z >> shift};
  const Direction e_short = {e.x >> shift, e.y >> shift, e.z >> shift};
  const int64_t ratio = Dot(d_short, d_short) * 32 / (Dot(e_short, e_short) + 1);
  return std::min(11, static_cast<int>(std::bit_width(static_cast<uint64_t>(ratio))));
}

GridPoint Parallelogram(const GridPoint& a, const GridPoint& b, const GridPoint& apex) {
  return {a[0] + b[0] - apex[0], a[1] + b[1] - apex[1], a[2] + b[2] - apex[2]};
}

std::array<int64_t, 3> GateNormal(const GridPoint& a, const GridPoint& b, const GridPoint& apex) {
  const Direction u = WithBits(Difference(b, a), 14), v = WithBits(Difference(apex, a), 14);
  return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

int EdgeBits(const GridPoint& a, const GridPoint& b) { return BitsOf(Difference(a, b)); }

}  // namespace rilievo
