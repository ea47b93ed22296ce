// Lines of numbers: XYZ, PTS, TXT, CSV.
#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/number_text.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "client/formats/text_fields.h"
#include "client/formats/xyz_heading.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

class XyzReader {
 public:
  XyzReader(ByteSource* source, const WantedLayers& wanted)
      : source_(*source), wanted_(wanted), sights_(wanted) {}

  absl::StatusOr<ScanFile> Read() {
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
    if (points_.offered() == 0) return absl::InvalidArgumentError("points: the file holds none");
    ScanFile scan;
    scan.format = axis_names_.empty() ? "text" : absl::StrCat("text, columns ", axis_names_);
    if (colors_are_guessed_) absl::StrAppend(&scan.format, sights_.KeepCertainColors());
    scan.cloud.sights = sights_.Finish(points_.count());
    if (!intensity_was_no_number_) scan.layers.intensity = sights_.FinishIntensity(points_.count());
    scan.cloud.points = points_.Finish();
    scan.class_counts = points_.class_counts();
    return scan;
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
    if (source_.line_number() == 1) line = WithoutByteOrderMark(line);
    if (HasNoFields(line)) return absl::OkStatus();
    if (const std::optional<std::string_view> comment = CommentIn(line)) {
      TakeComment(*comment);
      return absl::OkStatus();
    }
    if (!seen_data_ && !HasNumber(line)) return TakeHeading(line);
    const bool block_open = block_left_.value_or(0) > 0;
    const bool may_count = block_left_ ? !block_open : points_.offered() == 0;
    if (may_count) {
      std::string_view rest = line;
      const TextField only = NextField(&rest);
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
      if (ParseNumber(NextField(&line).text, &value).ok()) return true;
    }
    return false;
  }

  // Names of columns; those called x, y and z are the coordinates.
  absl::Status TakeHeading(std::string_view line) {
    if (line.find('\0') != std::string_view::npos) return LineError("binary data, not text");
    if (seen_heading_) return LineError("words where numbers belong: ", Quoted(line));
    seen_heading_ = true;
    const std::optional<XyzHeading> heading = ParseXyzHeading(line);
    if (!heading) {
      return LineError(
          "neither numbers nor a heading that names the columns x, y and z (or easting, northing "
          "and "
          "height)");
    }
    Follow(*heading);
    commented_heading_.reset();
    return absl::OkStatus();
  }

  // A heading may be a comment, "//X Y Z R G B". So may be a sentence with the same words: the
  // first point tells, by the number of its columns.
  void TakeComment(std::string_view text) {
    if (seen_heading_ || points_.offered() > 0) return;
    if (const auto heading = ParseXyzHeading(text)) commented_heading_ = heading;
  }

  void FollowComment(std::string_view line) {
    const FieldCount count = CountFields(line);
    const size_t named = commented_heading_->names.size();
    if (count.filled <= named && named <= count.all) Follow(*commented_heading_);
    commented_heading_.reset();
  }

  void Follow(const XyzHeading& heading) {
    columns_.assign(heading.axis_column.begin(), heading.axis_column.end());
    columns_needed_ = 1 + *std::max_element(columns_.begin(), columns_.end());
    const auto find = [&](std::string_view name) {
      const auto found = std::find(heading.names.begin(), heading.names.end(), name);
      return found == heading.names.end() ? -1 : static_cast<int>(found - heading.names.begin());
    };
    sight_columns_ = SightColumns(wanted_, find, &columns_);
    axis_names_ = heading.axis_names;
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

  struct FieldCount {
    size_t filled = 0;  // without the empty ones at the end
    size_t all = 0;
  };
  static FieldCount CountFields(std::string_view line) {
    FieldCount count;
    while (!line.empty()) {
      const TextField field = NextField(&line);
      ++count.all;
      if (!field.text.empty()) count.filled = count.all;
      if (line.empty() && field.gap != FieldGap::kNone) ++count.all;
    }
    return count;
  }

  // Without a heading three columns behind x y z, or behind x y z and the intensity as in PTS, may
  // be colours: their numbers tell, and where a word stands there they are none. What begins with
  // a count is PTS.
  void GuessColumns(std::string_view line) {
    if (!axis_names_.empty()) return;
    const auto columns = static_cast<int>(CountFields(line).filled);
    if (wanted_.intensity && block_left_ && (columns == 4 || columns == 7)) {
      sight_columns_.AddIntensityAt(3, &columns_);
    }
    if (!wanted_.colors || (columns != 6 && columns != 7)) return;
    sight_columns_.AddColorsAt(columns - 3, &columns_);
    colors_are_guessed_ = true;
  }

  // Into the values that are wanted of this column.
  absl::Status TakeField(int column, std::string_view text) {
    for (size_t place = 0; place < columns_.size(); ++place) {
      if (columns_[place] != column) continue;
      if (text.empty() && place < 3) {
        constexpr const char* kAxes[] = {"x", "y", "z"};
        return LineError("nothing between two separators in column ", column + 1, ", where ",
                         kAxes[place], " belongs; give every point its three coordinates");
      }
      if (text.empty()) continue;
      const absl::Status status = ParseNumber(text, &values_[place]);
      if (status.ok()) continue;
      if (place < 3 || !axis_names_.empty()) return LineError(status.message());
      intensity_was_no_number_ |= column == 3;
      values_[place] = std::numeric_limits<double>::quiet_NaN();
    }
    return absl::OkStatus();
  }

  absl::Status TakePoint(std::string_view line) {
    if (commented_heading_) FollowComment(line);
    if (points_.offered() == 0) GuessColumns(line);
    // What a line lacks is not known.
    values_.assign(columns_.size(), std::numeric_limits<double>::quiet_NaN());
    const int last_column = *std::max_element(columns_.begin(), columns_.end());
    FieldGap first_gap = FieldGap::kNone;
    int column = 0;
    for (; column <= last_column && !line.empty(); ++column) {
      const TextField next = NextField(&line);
      RILIEVO_RETURN_IF_ERROR(TakeField(column, next.text));
      // "0,5 1,25 0": commas without blanks among other separators are decimal commas.
      if (column == 0) first_gap = next.gap;
      const bool comma = next.gap == FieldGap::kComma, first_comma = first_gap == FieldGap::kComma;
      const bool last = column + 1 >= columns_needed_;
      if (column < columns_needed_ && comma != first_comma && !line.empty() && (comma || !last)) {
        return LineError("commas beside other separators: decimal commas? write points, as in 0.5");
      }
    }
    if (column < columns_needed_) {
      if (!source_.line_was_ended() && block_left_) return Truncated();
      return LineError(column, " values, ", columns_needed_, " needed for x, y and z");
    }
    sight_columns_.Take(values_.data(), &points_, &sights_);
    return points_.status();
  }

  ByteSource& source_;
  const WantedLayers wanted_;
  PointCollector points_{wanted_};
  SightCollector sights_;
  SightColumns sight_columns_;
  std::vector<double> values_;                   // of the point at hand, by place in columns_
  std::optional<uint64_t> block_left_;           // points still to come after a count line
  std::optional<XyzHeading> commented_heading_;  // until the first point
  std::string axis_names_;                       // of a heading that is followed
  std::vector<int> columns_ = {0, 1, 2};         // x, y, z, then sights
  int columns_needed_ = 3;
  bool seen_heading_ = false, seen_data_ = false, colors_are_guessed_ = false;
  bool intensity_was_no_number_ = false;  // of some point, in a column that has no name
};

}  // namespace

absl::StatusOr<ScanFile> ReadXyzScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  return XyzReader(&source, wanted).Read();
}

}  // namespace rilievo
