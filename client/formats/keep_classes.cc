#include "client/formats/keep_classes.h"

#include <string>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

using ClassCounts = std::array<int64_t, 256>;
using ClassSet = std::array<bool, 256>;

ClassSet SetOf(std::span<const uint8_t> classes) {
  ClassSet set{};
  for (const uint8_t number : classes) set[number] = true;
  return set;
}

// "2 (12345 points), 6 (17 points)".
std::string ClassesThere(const ClassCounts& counts) {
  std::string text;
  for (size_t number = 0; number < counts.size(); ++number) {
    if (counts[number] == 0) continue;
    absl::StrAppend(&text, text.empty() ? "" : ", ", number, " (", counts[number], " points)");
  }
  return text;
}

absl::Status NotClassified(const ScanFile& scan) {
  return absl::InvalidArgumentError(absl::StrCat(
      "classes: this scan (", scan.format,
      ") does not give each point a class; LAS and LAZ do, PLY, PCD, E57 and text with a field "
      "'classification'; take all points instead"));
}

// Says in the scan's format what was kept of it.
absl::Status TellKept(const ClassCounts& counts, const ClassSet& wanted, ScanFile* scan) {
  int64_t all = 0, kept = 0;
  for (size_t number = 0; number < counts.size(); ++number) {
    all += counts[number];
    if (wanted[number]) kept += counts[number];
  }
  if (kept == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "classes: no point has one of those asked for; there are ", ClassesThere(counts)));
  }
  absl::StrAppend(&scan->format, ", ", kept, " of ", all, " points by class");
  return absl::OkStatus();
}

}  // namespace

absl::Status KeepClasses(std::span<const uint8_t> classes, ScanFile* scan) {
  Eigen::Matrix3Xd& points = scan->cloud.points;
  const auto count = static_cast<size_t>(points.cols());
  if (scan->classes.empty() || scan->classes.size() != count) return NotClassified(*scan);
  const ClassSet wanted = SetOf(classes);
  ClassCounts counts{};
  std::vector<uint8_t> keep(count);
  Eigen::Index kept = 0;
  for (size_t i = 0; i < count; ++i) {
    ++counts[scan->classes[i]];
    keep[i] = wanted[scan->classes[i]] ? 1 : 0;
    if (keep[i] == 0) continue;
    points.col(kept) = points.col(static_cast<Eigen::Index>(i));
    if (!scan->layers.intensity.empty()) scan->layers.intensity[kept] = scan->layers.intensity[i];
    ++kept;
  }
  if (const absl::Status told = TellKept(counts, wanted, scan); !told.ok()) return told;
  points.conservativeResize(3, kept);
  if (!scan->layers.intensity.empty()) scan->layers.intensity.resize(static_cast<size_t>(kept));
  KeepSights(keep, &scan->cloud.sights);
  scan->classes.clear();
  return absl::OkStatus();
}

ClassSink::ClassSink(std::span<const uint8_t> classes, PointSink* sink)
    : wanted_(SetOf(classes)), sink_(*sink) {}

// How many of them are wanted is not known.
absl::Status ClassSink::Expect(uint64_t /*points*/) { return sink_.Expect(0); }

void ClassSink::TakeClasses(std::span<const uint8_t> classes) {
  classes_.assign(classes.begin(), classes.end());
}

void ClassSink::Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  if (classes_.size() != static_cast<size_t>(points.cols())) {
    all_have_one_ = false;
    return;
  }
  Eigen::Matrix3Xd kept(3, points.cols());
  Eigen::Index count = 0;
  for (size_t i = 0; i < classes_.size(); ++i) {
    ++counts_[classes_[i]];
    if (wanted_[classes_[i]]) kept.col(count++) = points.col(static_cast<Eigen::Index>(i));
  }
  classes_.clear();
  if (count > 0) sink_.Take(kept.leftCols(count));
}

absl::Status ClassSink::Finish(ScanFile* scan) const {
  if (!all_have_one_) return NotClassified(*scan);
  return TellKept(counts_, wanted_, scan);
}

}  // namespace rilievo
