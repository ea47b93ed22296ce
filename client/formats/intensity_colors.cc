#include "client/formats/intensity_colors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <vector>

#include "absl/strings/str_cat.h"

namespace rilievo {

absl::Status ColorByIntensity(ScanFile* scan) {
  const std::vector<float>& intensity = scan->layers.intensity;
  if (intensity.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("colours: this scan (", scan->format,
                     ") does not give each point an intensity; take its colours, or none"));
  }
  std::vector<float> finite;
  std::copy_if(intensity.begin(), intensity.end(), std::back_inserter(finite),
               [](float value) { return std::isfinite(value); });
  float low = 0, high = 0;
  if (!finite.empty()) {
    const size_t hundredth = finite.size() / 100;
    const auto at = [&](size_t place) {
      std::nth_element(finite.begin(), finite.begin() + static_cast<std::ptrdiff_t>(place),
                       finite.end());
      return finite[place];
    };
    low = at(hundredth);
    high = at(finite.size() - 1 - hundredth);
  }
  if (!(low < high)) {
    return absl::InvalidArgumentError(
        absl::StrCat("colours: the intensity of this scan (", scan->format, ") is ", low,
                     " nearly everywhere; take its colours, or none"));
  }
  std::vector<Rgb>& colors = scan->cloud.sights.colors;
  colors.clear();
  colors.reserve(intensity.size());
  for (const float value : intensity) {
    const double share = std::isfinite(value) ? (double{value} - low) / (double{high} - low) : 0;
    const auto grey = static_cast<uint8_t>(share >= 1  ? 255
                                           : share > 0 ? std::lround(255 * share)
                                                       : 0);
    colors.push_back({grey, grey, grey});
  }
  return absl::OkStatus();
}

}  // namespace rilievo
