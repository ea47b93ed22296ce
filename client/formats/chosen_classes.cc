#include "client/formats/chosen_classes.h"

#include <numeric>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// "2 (12345 points), 6 (17 points)".
std::string ClassesThere(std::span<const int64_t> counts) {
  std::string text;
  for (size_t number = 0; number < counts.size(); ++number) {
    if (counts[number] == 0) continue;
    absl::StrAppend(&text, text.empty() ? "" : ", ", number, " (", counts[number], " points)");
  }
  return text;
}

}  // namespace

absl::Status TellChosen(std::span<const uint8_t> classes, ScanFile* scan) {
  std::vector<int64_t>& counts = scan->class_counts;
  if (counts.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "classes: this scan (", scan->format,
        ") does not give each point a class; LAS and LAZ do, PLY, PCD, E57 and text with a field "
        "'classification'; take all points instead"));
  }
  const std::string there = ClassesThere(counts);
  const int64_t all = std::accumulate(counts.begin(), counts.end(), int64_t{0});
  int64_t chosen = 0;
  for (const uint8_t number : classes) {
    chosen += counts[number];
    counts[number] = 0;  // named twice, its points are counted once
  }
  if (chosen == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("classes: no point has one of those asked for; there are ", there));
  }
  absl::StrAppend(&scan->format, ", ", chosen, " of ", all, " points by class");
  counts.clear();
  return absl::OkStatus();
}

}  // namespace rilievo
