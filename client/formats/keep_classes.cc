#include "client/formats/keep_classes.h"

#include <array>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// "2 (12345 points), 6 (17 points)".
std::string ClassesThere(const std::vector<uint8_t>& classes) {
  std::array<int64_t, 256> counts{};
  for (const uint8_t number : classes) ++counts[number];
  std::string text;
  for (size_t number = 0; number < counts.size(); ++number) {
    if (counts[number] == 0) continue;
    absl::StrAppend(&text, text.empty() ? "" : ", ", number, " (", counts[number], " points)");
  }
  return text;
}

}  // namespace

absl::Status KeepClasses(std::span<const uint8_t> classes, ScanFile* scan) {
  Eigen::Matrix3Xd& points = scan->cloud.points;
  const auto count = static_cast<size_t>(points.cols());
  if (scan->classes.size() != count) {
    return absl::InvalidArgumentError(absl::StrCat(
        "classes: this scan (", scan->format,
        ") does not give each point a class; LAS and LAZ do, PLY, PCD, E57 and text with a field "
        "'classification'; take all points instead"));
  }
  std::array<bool, 256> is_wanted{};
  for (const uint8_t number : classes) is_wanted[number] = true;
  std::vector<uint8_t> keep(count);
  Eigen::Index kept = 0;
  for (size_t i = 0; i < count; ++i) {
    keep[i] = is_wanted[scan->classes[i]] ? 1 : 0;
    if (keep[i] == 0) continue;
    points.col(kept) = points.col(static_cast<Eigen::Index>(i));
    if (!scan->layers.intensity.empty()) scan->layers.intensity[kept] = scan->layers.intensity[i];
    ++kept;
  }
  if (kept == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("classes: no point has one of those asked for; "
                     "there are ",
                     ClassesThere(scan->classes)));
  }
  points.conservativeResize(3, kept);
  if (!scan->layers.intensity.empty()) scan->layers.intensity.resize(static_cast<size_t>(kept));
  KeepSights(keep, &scan->cloud.sights);
  scan->classes.clear();
  absl::StrAppend(&scan->format, ", ", kept, " of ", count, " points by class");
  return absl::OkStatus();
}

}  // namespace rilievo
