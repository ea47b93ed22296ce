// Lines of numbers: XYZ, PTS, TXT, CSV.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/number_text.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// What stood between two columns.
enum class Gap { kNone, kBlank, kComma, kSpacedComma, kSemicolon };

struct Column {
  std::string_view text;  // empty at the end of the line
  Gap gap = Gap::kNone;   // before the next column
};

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool IsSeparator(char c) { return IsBlank(c) || c == ',' || c == ';'; }

Column NextColumn(std::string_view* line) {
  Column column;
  size_t end = 0;
  while (end < line->size() && !IsSeparator((*line)[end])) ++end;
  column.text = line->substr(0, end);
  bool blank = false, comma = false, semicolon = false;
  for (; end < line->size() && IsSeparator((*line)[end]); ++end) {
    blank |= IsBlank((*line)[end]);
    comma |= (*line)[end] == ',';
    semicolon |= (*line)[end] == ';';
  }
  if (end < line->size()) {
    column.gap = comma       ? (blank ? Gap::kSpacedComma : Gap::kComma)
                 : semicolon ? Gap::kSemicolon
                             : Gap::kBlank;
  }
  line->remove_prefix(end);
  return column;
}

class XyzReader {
 public:
  explicit XyzReader(ByteSource* source) : source_(*source) {}

  absl::StatusOr<Eigen::Matrix3Xd> Read() {
    std::string_view line;
    for (;;) {
      const ByteSource::Line result = source_.NextLine(&line);
      if (result == ByteSource::Line::kEnd) break;
      if (result == ByteSource::Line::kTooLong) {
        return absl::InvalidArgumentError(absl::StrCat("points, line ", source_.line_number() + 1,
                                                       ": over 1 MiB; is this a text file?"));
      }
      RILIEVO_RETURN_IF_ERROR(TakeLine(line));
    }
    if (block_left_.value_or(0) > 0) return Truncated();
    if (points_.count() == 0) return absl::InvalidArgumentError("points: the file holds none");
    return points_.Finish();
  }

 private:
  template <typename... What>
  absl::Status LineError(const What&... what) const {
    return absl::InvalidArgumentError(
        absl::StrCat("points, line ", source_.line_number(), ": ", what...));
  }

  absl::Status Truncated() const {
    return absl::DataLossError(absl::StrCat(
        "points: ", *block_left_, " fewer than the count line announces; truncated file?"));
  }

  absl::Status TakeLine(std::string_view line) {
    while (!line.empty() && IsSeparator(line.front())) line.remove_prefix(1);
    if (line.empty() || line.front() == '#' || line.substr(0, 2) == "//") return absl::OkStatus();
    if (!seen_data_ && !HasNumber(line)) return TakeHeading(line);
    const bool block_open = block_left_.value_or(0) > 0;
    const bool may_count = block_left_ ? !block_open : points_.count() == 0;
    if (may_count) {
      std::string_view rest = line;
      const Column only = NextColumn(&rest);
      uint64_t count = 0;
      if (rest.empty() && ParseCount(only.text, &count)) return TakeCount(count);
    }
    seen_data_ = true;
    if (block_left_ && !block_open) return LineError("more points than the count line announces");
    RILIEVO_RETURN_IF_ERROR(TakePoint(line));
    if (block_left_) --*block_left_;
    return absl::OkStatus();
  }

  static bool HasNumber(std::string_view line) {
    while (!line.empty()) {
      double value;
      if (ParseNumber(NextColumn(&line).text, &value).ok()) return true;
    }
    return false;
  }

  // Names of columns; those called x, y and z are the coordinates.
  absl::Status TakeHeading(std::string_view line) {
    if (line.find('\0') != std::string_view::npos) return LineError("binary data, not text");
    if (seen_heading_) return LineError("words where numbers belong: ", Quoted(line));
    seen_heading_ = true;
    std::array<int, 3> found = {-1, -1, -1};
    for (int column = 0; !line.empty(); ++column) {
      const std::string name = absl::AsciiStrToLower(std::string(NextColumn(&line).text));
      for (int axis = 0; axis < 3; ++axis) {
        if (name.size() == 1 && name[0] == 'x' + axis && found[axis] < 0) found[axis] = column;
      }
    }
    if (*std::min_element(found.begin(), found.end()) < 0) {
      return LineError("neither numbers nor a heading that names the columns x, y and z");
    }
    axis_column_ = found;
    columns_needed_ = 1 + *std::max_element(found.begin(), found.end());
    return absl::OkStatus();
  }

  absl::Status TakeCount(uint64_t count) {
    seen_data_ = true;
    // The shortest line of a point is "0 0 0" and a line end, which the last may lack.
    if (source_.remaining() && count > (*source_.remaining() + 1) / 6) {
      return absl::DataLossError(absl::StrCat(
          "points, line ", source_.line_number(), ": announces ", count, " points, the ",
          *source_.remaining(), " bytes left hold at most ", (*source_.remaining() + 1) / 6));
    }
    block_left_ = count;
    return absl::OkStatus();
  }

  absl::Status TakePoint(std::string_view line) {
    std::array<double, 3> point{};
    Gap first_gap = Gap::kNone;
    for (int column = 0; column < columns_needed_; ++column) {
      const Column next = NextColumn(&line);
      if (next.text.empty()) {
        if (!source_.line_was_ended() && block_left_) return Truncated();
        return LineError(column, " values, ", columns_needed_, " needed for x, y and z");
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (axis_column_[axis] != column) continue;
        if (const absl::Status status = ParseNumber(next.text, &point[axis]); !status.ok()) {
          return LineError(status.message());
        }
      }
      // "0,5 1,25 0": commas without blanks among other separators are decimal commas.
      if (column == 0) first_gap = next.gap;
      const bool comma = next.gap == Gap::kComma, first_comma = first_gap == Gap::kComma;
      const bool last = column + 1 == columns_needed_;
      if (comma != first_comma && (comma || !last)) {
        return LineError("commas beside other separators: decimal commas? write points, as in 0.5");
      }
    }
    points_.Add(point[0], point[1], point[2]);
    return absl::OkStatus();
  }

  ByteSource& source_;
  PointCollector points_;
  std::optional<uint64_t> block_left_;  // points still to come after a count line
  std::array<int, 3> axis_column_ = {0, 1, 2};
  int columns_needed_ = 3;
  bool seen_heading_ = false, seen_data_ = false;
};

}  // namespace

absl::StatusOr<ScanFile> ReadXyzScan(std::istream& in) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points, XyzReader(&source).Read());
  return ScanFile{{std::move(points)}, "text"};
}

}  // namespace rilievo
