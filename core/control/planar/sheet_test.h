// Whether values along a line come from one sheet of a surface or from several.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace rilievo {

// The widest gap at which `sorted` (ascending) breaks into two groups, each of at least two values
// and a tenth of all: a single stray point does not count. 0 for fewer than four values.
inline double SheetGap(std::span<const double> sorted) {
  const size_t least = std::max<size_t>(2, sorted.size() / 10);
  double widest = 0;
  for (size_t i = least; i + least <= sorted.size(); ++i) {
    widest = std::max(widest, sorted[i] - sorted[i - 1]);
  }
  return widest;
}

inline bool HasTwoSheets(std::span<const double> sorted, double gap) {
  return SheetGap(sorted) > gap;
}

}  // namespace rilievo
