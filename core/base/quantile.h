// Quantiles of numbers in any order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace rilievo {

// The value below which `share` of the values lie, one of them: of n in order that with the number
// share * (n - 1), rounded down. `share`: [0, 1]; one half for the median. 0 of no values.
template <typename T>
T Quantile(std::vector<T> values, double share) {
  if (values.empty()) return T();
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

template <typename T>
T Median(std::vector<T> values) {
  return Quantile(std::move(values), 0.5);
}

}  // namespace rilievo
