// Two groups of heights, as of the sheets of a wall.
#pragma once

#include <span>

namespace rilievo {

struct OtsuSplit {
  double threshold = 0;  // between them
  double within = 1;     // what is left of the squares within the groups, as a share
};

// Otsu's threshold (Otsu 1979), with at least `fewest` heights on either side; no split where there
// are fewer than twice as many. `within` is 0.36 of Gaussian heights and 0.25 of uniform ones.
// Sorts the heights.
OtsuSplit OtsuThreshold(std::span<double> heights, int fewest);

}  // namespace rilievo
