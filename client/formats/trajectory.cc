#include "client/formats/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/number_text.h"
#include "client/formats/text_fields.h"
#include "client/formats/xyz_heading.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr std::string_view kTimeNames[] = {"time", "gps_time", "gpstime", "gps time", "t"};

// Of time, x, y and z.
using TrajectoryColumns = std::array<int, 4>;

std::optional<TrajectoryColumns> ColumnsNamed(std::string_view line) {
  const std::optional<XyzHeading> heading = ParseXyzHeading(line);
  if (!heading) return std::nullopt;
  for (const std::string_view name : kTimeNames) {
    const auto found = std::find(heading->names.begin(), heading->names.end(), name);
    if (found == heading->names.end()) continue;
    return TrajectoryColumns{static_cast<int>(found - heading->names.begin()),
                             heading->axis_column[0], heading->axis_column[1],
                             heading->axis_column[2]};
  }
  return std::nullopt;
}

// The numbers of the columns.
absl::StatusOr<std::array<double, 4>> NumbersIn(std::string_view line,
                                                const TrajectoryColumns& columns) {
  std::array<double, 4> numbers;
  numbers.fill(std::numeric_limits<double>::quiet_NaN());
  for (int column = 0; !line.empty(); ++column) {
    const std::string_view text = NextField(&line).text;
    if (text.empty()) continue;
    for (size_t k = 0; k < numbers.size(); ++k) {
      if (columns[k] == column) RILIEVO_RETURN_IF_ERROR(ParseNumber(text, &numbers[k]));
    }
  }
  for (const double number : numbers) {
    if (std::isfinite(number)) continue;
    return absl::InvalidArgumentError("time, x, y and z are needed, four finite numbers");
  }
  return numbers;
}

}  // namespace

absl::StatusOr<Trajectory> Trajectory::Read(std::istream& in) {
  ByteSource source(in);
  Trajectory trajectory;
  TrajectoryColumns columns = {0, 1, 2, 3};
  std::string_view line;
  for (ByteSource::Line read; (read = source.NextLine(&line)) != ByteSource::Line::kEnd;) {
    const auto wrong = [&](absl::string_view what) {
      return absl::InvalidArgumentError(
          absl::StrCat("trajectory: line ", source.line_number(), ": ", what));
    };
    if (read == ByteSource::Line::kTooLong) return wrong("is not one of text");
    line = WithoutByteOrderMark(line);
    if (HasNoFields(line)) continue;
    const std::optional<std::string_view> comment = CommentIn(line);
    if (trajectory.fixes_.empty()) {
      if (const auto named = ColumnsNamed(comment.value_or(line))) {
        columns = *named;
        continue;
      }
    }
    if (comment) continue;
    const absl::StatusOr<std::array<double, 4>> numbers = NumbersIn(line, columns);
    if (!numbers.ok()) return wrong(numbers.status().message());
    trajectory.fixes_.push_back({(*numbers)[0], Eigen::Vector3d(numbers->data() + 1)});
  }
  std::vector<Fix>& fixes = trajectory.fixes_;
  std::stable_sort(fixes.begin(), fixes.end(),
                   [](const Fix& a, const Fix& b) { return a.time < b.time; });
  fixes.erase(std::unique(fixes.begin(), fixes.end(),
                          [](const Fix& a, const Fix& b) { return a.time == b.time; }),
              fixes.end());
  if (fixes.size() >= 2) return trajectory;
  return absl::InvalidArgumentError(absl::StrCat("trajectory: ", fixes.size(),
                                                 " times; at least two are needed, in lines of "
                                                 "time, x, y and z"));
}

Eigen::Vector3d Trajectory::At(double time) const {
  const auto unknown = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  if (!(time >= first_time() && time <= last_time())) return unknown;
  const auto found = std::lower_bound(fixes_.begin() + 1, fixes_.end() - 1, time,
                                      [](const Fix& fix, double t) { return fix.time < t; });
  const Fix &before = *(found - 1), &after = *found;
  if (after.time - before.time > kLongestGap) return unknown;
  const double share = (time - before.time) / (after.time - before.time);
  return before.place + share * (after.place - before.place);
}

}  // namespace rilievo
