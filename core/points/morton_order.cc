#include "core/points/morton_order.h"

#include <algorithm>

#include "core/base/parallel_for_each.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Puts two zero bits between any two of the 21 low bits.
uint64_t Spread(uint64_t bits) {
  bits &= 0x1fffffull;
  bits = (bits | bits << 32) & 0x001f00000000ffffull;
  bits = (bits | bits << 16) & 0x001f0000ff0000ffull;
  bits = (bits | bits << 8) & 0x100f00f00f00f00full;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3ull;
  bits = (bits | bits << 2) & 0x1249249249249249ull;
  return bits;
}

}  // namespace

uint32_t MortonCell(double coordinate) {
  constexpr double kCells = 1 << kMortonBits;
  return static_cast<uint32_t>(std::clamp((coordinate + 0.5) * kCells, 0.0, kCells - 1));
}

uint64_t MortonCode(uint32_t x, uint32_t y, uint32_t z) {
  return Spread(x) | Spread(y) << 1 | Spread(z) << 2;
}

absl::StatusOr<MortonOrder> ComputeMortonOrder(const Eigen::Matrix3Xd& points,
                                               const RunContext& context) {
  struct Entry {
    uint64_t code;
    int column;
  };
  std::vector<Entry> entries(static_cast<size_t>(points.cols()));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(points.cols(), kLightBlock, context, [&](int64_t i) {
    entries[i] = {
        MortonCode(MortonCell(points(0, i)), MortonCell(points(1, i)), MortonCell(points(2, i))),
        static_cast<int>(i)};
  }));
  const auto coordinates_less = [&](int a, int b) {
    for (int axis = 0; axis < 3; ++axis) {
      if (points(axis, a) != points(axis, b)) return points(axis, a) < points(axis, b);
    }
    return a < b;
  };
  RILIEVO_RETURN_IF_ERROR(ParallelSort(
      [&](const Entry& a, const Entry& b) {
        return a.code != b.code ? a.code < b.code : coordinates_less(a.column, b.column);
      },
      context, &entries));
  MortonOrder result;
  result.order.reserve(entries.size());
  result.codes.reserve(entries.size());
  for (const Entry& entry : entries) {
    result.order.push_back(entry.column);
    result.codes.push_back(entry.code);
  }
  return result;
}

}  // namespace rilievo
