// Leica's PTX: grids of points in the scanner's own coordinates, each with its transform.
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/number_text.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// The numbers of a line, as many as it has or `most`.
absl::StatusOr<int> Numbers(std::string_view line, int most, double* values) {
  int count = 0;
  for (auto word = NextWord(&line); !word.empty() && count < most; word = NextWord(&line)) {
    RILIEVO_RETURN_IF_ERROR(ParseNumber(word, &values[count++]));
  }
  return count;
}

class PtxReader {
 public:
  PtxReader(ByteSource* source, const WantedLayers& wanted)
      : source_(*source), wanted_(wanted), sights_(wanted) {
    sights_.set_color_kind(ColorCollector::Kind::kBytes);
  }

  absl::StatusOr<ScanFile> Read() {
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const bool begins, BeginCloud());
      if (!begins) break;
      for (; left_ > 0; --left_) RILIEVO_RETURN_IF_ERROR(TakePoint());
      ++clouds_;
    }
    if (clouds_ == 0) return absl::InvalidArgumentError("PTX: the file holds no cloud");
    if (points_.count() == 0) return absl::InvalidArgumentError("PTX: no ray has met anything");
    ScanFile scan;
    scan.format = absl::StrCat("PTX, ", clouds_, clouds_ == 1 ? " cloud" : " clouds");
    if (empty_ > 0) absl::StrAppend(&scan.format, ", ", empty_, " rays without a return");
    absl::StrAppend(&scan.format, sights_.LeftOut(points_.count()));
    scan.cloud.sights = sights_.Finish(points_.count());
    scan.cloud.points = points_.Finish();
    // A layer that one of the clouds lacks is left out.
    const auto count = static_cast<size_t>(scan.cloud.points.cols());
    if (intensity_.size() == count) scan.layers.intensity = std::move(intensity_);
    return scan;
  }

 private:
  template <typename... What>
  absl::Status LineError(const What&... what) const {
    return absl::InvalidArgumentError(
        absl::StrCat("PTX, line ", source_.line_number(), ": ", what...));
  }

  // `blank_before`: lines without anything are passed over.
  absl::StatusOr<bool> NextLine(bool blank_before, std::string_view* line) {
    for (;;) {
      const ByteSource::Line result = source_.NextLine(line);
      if (result == ByteSource::Line::kEnd) return false;
      if (result == ByteSource::Line::kTooLong) {
        return absl::InvalidArgumentError(absl::StrCat("PTX, line ", source_.line_number() + 1,
                                                       ": over 1 MiB; is this a text file?"));
      }
      std::string_view rest = *line;
      if (!blank_before || !NextWord(&rest).empty()) return true;
    }
  }

  absl::Status CutOff(const char* where) const {
    return absl::DataLossError(absl::StrCat("PTX: the file ends within ", where, " of cloud ",
                                            clouds_ + 1, "; truncated file?"));
  }

  // False at the end of the file.
  absl::StatusOr<bool> BeginCloud() {
    std::array<uint64_t, 2> size{};
    for (int i = 0; i < 2; ++i) {
      std::string_view line;
      RILIEVO_ASSIGN_OR_RETURN(const bool there, NextLine(true, &line));
      if (!there && i == 0) return false;
      if (!there) return CutOff("the header");
      const std::string_view word = NextWord(&line);
      if (!ParseCount(word, &size[i]) || !NextWord(&line).empty()) {
        return LineError("the number of ", i == 0 ? "columns" : "rows", " of cloud ", clouds_ + 1,
                         " is due, there is ", Quoted(word));
      }
    }
    RILIEVO_RETURN_IF_ERROR(CheckCount(size[0], size[1]));
    // The scanner's registered position and its axes, which the matrix says once more.
    std::array<double, 3> position{}, axis;
    for (int row = 0; row < 4; ++row) {
      RILIEVO_RETURN_IF_ERROR(
          TakeHeaderRow("the scanner's position and axes", row == 0 ? position : axis));
    }
    for (int row = 0; row < 4; ++row) {
      std::array<double, 4> values;
      RILIEVO_RETURN_IF_ERROR(TakeHeaderRow("the transform", values));
      const double last = row < 3 ? 0 : 1;
      if (std::abs(values[3] - last) > 1e-9) {
        return LineError("the last column of the transform must be 0 0 0 1, here it holds ",
                         values[3]);
      }
      // Points are rows: scan = local * matrix.
      const Eigen::Vector3d image(values[0], values[1], values[2]);
      if (row < 3) {
        rotation_.col(row) = image;
      } else {
        translation_ = image;
      }
    }
    // Programs that write no position leave it at zero; the scanner is at the origin of its own
    // coordinates.
    station_ = Eigen::Vector3d(position[0], position[1], position[2]);
    if (station_.isZero(0)) station_ = translation_;
    return true;
  }

  absl::Status CheckCount(uint64_t columns, uint64_t rows) {
    constexpr uint64_t kMost = uint64_t{1} << 40;
    const bool sane = columns > 0 && rows > 0 && columns < kMost && rows < kMost;
    if (!sane || columns > kMost / rows) {
      return LineError(columns, " columns of ", rows, " points are not possible");
    }
    left_ = columns * rows;
    // The shortest line of a point is "0 0 0" and a line end, which the last may lack.
    if (source_.remaining() && left_ > (*source_.remaining() + 1) / 6) {
      return absl::DataLossError(absl::StrCat(
          "PTX, line ", source_.line_number(), ": announces ", left_, " points, the ",
          *source_.remaining(), " bytes left hold at most ", (*source_.remaining() + 1) / 6));
    }
    return absl::OkStatus();
  }

  template <size_t kCount>
  absl::Status TakeHeaderRow(const char* what, std::array<double, kCount>& values) {
    std::string_view line;
    RILIEVO_ASSIGN_OR_RETURN(const bool there, NextLine(false, &line));
    if (!there) return CutOff("the header");
    const absl::StatusOr<int> count = Numbers(line, static_cast<int>(kCount), values.data());
    if (!count.ok()) return LineError(what, ": ", count.status().message());
    if (*count < static_cast<int>(kCount)) {
      if (!source_.line_was_ended()) return CutOff("the header");
      return LineError(what, ": ", *count, " values, ", kCount, " needed");
    }
    for (const double value : values) {
      if (!std::isfinite(value)) return LineError(what, ": ", value, " is not finite");
    }
    return absl::OkStatus();
  }

  // x y z intensity red green blue, the last four or three of which may be left out.
  absl::Status TakePoint() {
    std::string_view line;
    RILIEVO_ASSIGN_OR_RETURN(const bool there, NextLine(false, &line));
    if (!there) return CutOff("the points");
    std::array<double, 7> values;
    const absl::StatusOr<int> count = Numbers(line, 7, values.data());
    if (!count.ok()) return LineError(count.status().message());
    if (*count < 3) {
      if (!source_.line_was_ended()) return CutOff("the points");
      return LineError(*count, " values, a point has 3, 4 or 7");
    }
    const Eigen::Vector3d local(values[0], values[1], values[2]);
    if (local.isZero(0)) {
      ++empty_;
      return absl::OkStatus();
    }
    const Eigen::Vector3d point = rotation_ * local + translation_;
    points_.Add(point.x(), point.y(), point.z());
    sights_.AddStation(station_);
    if (wanted_.intensity && *count >= 4) intensity_.push_back(static_cast<float>(values[3]));
    if (*count == 7) sights_.AddColor(&values[4]);
    return points_.status();
  }

  ByteSource& source_;
  const WantedLayers wanted_;
  PointCollector points_{wanted_};
  SightCollector sights_;
  std::vector<float> intensity_;
  Eigen::Matrix3d rotation_;  // scan = rotation * local + translation
  Eigen::Vector3d translation_, station_;
  uint64_t left_ = 0;  // points of this cloud
  int64_t clouds_ = 0, empty_ = 0;
};

}  // namespace

absl::StatusOr<ScanFile> ReadPtxScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  return PtxReader(&source, wanted).Read();
}

}  // namespace rilievo
