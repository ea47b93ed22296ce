// Whether values along a line come from one sheet of a surface or from several.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace rilievo {

// True when `sorted` (ascending) breaks into two groups more than `gap` apart, each of at least two
// values and a tenth of all: a stray point is no sheet.
inline bool HasTwoSheets(std::span<const double> sorted, double gap) {
  const size_t least = std::max<size_t>(2, sorted.size() / 10);
  for (size_t i = least; i + least <= sorted.size(); ++i) {
    if (sorted[i] - sorted[i - 1] > gap) return true;
  }
  return false;
}

}  // namespace rilievo
