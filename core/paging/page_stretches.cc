#include "core/paging/page_stretches.h"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace rilievo {
namespace {

// Columns [begin, end).
struct ColumnStretch {
  size_t begin = 0, end = 0;
  Eigen::AlignedBox3d box;
  bool is_one_cell = false;  // of the finest: there is nothing to cut at

  // A longer one is cut first.
  double length() const { return is_one_cell ? 0 : box.diagonal().squaredNorm(); }
};

ColumnStretch StretchOf(size_t begin, size_t end, const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                        std::span<const uint64_t> codes) {
  const auto columns =
      points.middleCols(static_cast<Eigen::Index>(begin), static_cast<Eigen::Index>(end - begin));
  return {begin, end,
          Eigen::AlignedBox3d(columns.rowwise().minCoeff(), columns.rowwise().maxCoeff()),
          codes[begin] == codes[end - 1]};
}

// The first column with the highest bit in which the codes of the stretch differ.
size_t CutOf(const ColumnStretch& stretch, std::span<const uint64_t> codes) {
  const uint64_t last = codes[stretch.end - 1];
  const uint64_t apart = std::bit_floor(codes[stretch.begin] ^ last);
  const auto first = codes.begin() + static_cast<std::ptrdiff_t>(stretch.begin);
  const auto end = codes.begin() + static_cast<std::ptrdiff_t>(stretch.end);
  return static_cast<size_t>(std::lower_bound(first, end, last & ~(apart - 1)) - codes.begin());
}

}  // namespace

std::vector<PageStretch> CutStretches(const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                                      std::span<const uint64_t> codes) {
  std::vector<ColumnStretch> cut = {StretchOf(0, codes.size(), points, codes)};
  while (cut.size() < static_cast<size_t>(kStretchesOfPage)) {
    const auto longest = std::max_element(cut.begin(), cut.end(), [](const auto& a, const auto& b) {
      return a.length() < b.length();
    });
    if (longest->is_one_cell) break;
    const size_t middle = CutOf(*longest, codes);
    const ColumnStretch second = StretchOf(middle, longest->end, points, codes);
    *longest = StretchOf(longest->begin, middle, points, codes);
    cut.insert(longest + 1, second);
  }
  std::vector<PageStretch> stretches;
  for (const ColumnStretch& stretch : cut) {
    stretches.push_back({stretch.box, static_cast<int32_t>(stretch.end - stretch.begin)});
  }
  return stretches;
}

}  // namespace rilievo
