// LAS 1.0 to 1.4 and LAZ, all point formats.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/las_header.h"
#include "client/formats/las_variable_records.h"
#include "client/formats/laz/laz_records.h"
#include "client/formats/number_text.h"
#include "client/formats/point_collector.h"
#include "client/formats/scalar_type.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "client/formats/trajectory.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// "Withheld" points are deleted ones that the file still holds: a bit of the classification in
// formats 0 to 5, of the flags before it in the others.
bool IsWithheld(const char* record, int point_format) {
  const auto flags = static_cast<uint8_t>(record[15]);
  return (flags & (point_format < 6 ? 0x80 : 0x04)) != 0;
}

uint8_t ClassOf(const char* record, int point_format) {
  return point_format < 6 ? static_cast<uint8_t>(record[15] & 0x1f)
                          : static_cast<uint8_t>(record[16]);
}

// Whether the pulse went on to another return. Points without numbers have none behind them.
bool IsPassed(const char* record, int point_format) {
  const auto returns = static_cast<uint8_t>(record[14]);
  const int bits = point_format < 6 ? 3 : 4;
  const int mask = (1 << bits) - 1;
  return (returns & mask) < ((returns >> bits) & mask);
}

class LasReader {
 public:
  LasReader(const LasHeader& header, const WantedLayers& wanted)
      : header_(header),
        wanted_(wanted),
        color_offset_(wanted.colors ? kLasColorOffsets[header.point_format] : 0) {}

  absl::Status Read(ByteSource* source) {
    RILIEVO_ASSIGN_OR_RETURN(records_, ReadLasVariableRecords(source, header_));
    return header_.compressed ? ReadCompressed(source) : ReadPlain(source);
  }

  bool has_points() const { return points_.offered() > 0; }

  // INVALID_ARGUMENT where the trajectory covers the time of no point, if there are any.
  absl::Status CheckTimes() const {
    if (wanted_.trajectory == nullptr || has_stations_ || points_.count() == 0)
      return absl::OkStatus();
    const auto span = [](double first, double last) {
      std::string text = "from ";
      AppendNumber(first, &text);
      text += " to ";
      AppendNumber(last, &text);
      return text;
    };
    return absl::InvalidArgumentError(absl::StrCat(
        "LAS: the points have times ", span(first_time_, last_time_), ", the trajectory ",
        span(wanted_.trajectory->first_time(), wanted_.trajectory->last_time()),
        ": export both with the same kind of time, seconds of the GPS week or GPS seconds less "
        "1e9"));
  }

  ScanFile Finish() {
    ScanFile scan;
    scan.format = absl::StrCat(header_.compressed ? "LAZ 1." : "LAS 1.", header_.minor_version,
                               ", point format ", header_.point_format);
    if (withheld_ > 0) absl::StrAppend(&scan.format, ", without ", withheld_, " withheld points");
    if (wanted_.last_returns) {
      absl::StrAppend(&scan.format, ", without ", passed_, " returns before the last");
    }
    scan.cloud.sights = sights_.Finish(points_.count());
    scan.cloud.points = points_.Finish();
    scan.place.up = UpDirection::kZ;  // LAS 1.4 R15: Z is the elevation
    scan.place.crs = std::move(records_.crs);
    scan.layers.intensity = std::move(intensity_);
    scan.class_counts = points_.class_counts();
    if (largest_channel_ == 0) return scan;  // black is what programs write that have no colours
    // 16 bits a channel, but many programs write 8.
    const int shift = largest_channel_ > 255 ? 8 : 0;
    std::vector<Rgb>& colors = scan.cloud.sights.colors;
    colors.reserve(colors_.size());
    for (const std::array<uint16_t, 3>& color : colors_) {
      colors.push_back({static_cast<uint8_t>(color[0] >> shift),
                        static_cast<uint8_t>(color[1] >> shift),
                        static_cast<uint8_t>(color[2] >> shift)});
    }
    return scan;
  }

 private:
  absl::Status ReadPlain(ByteSource* source) {
    if (source->remaining()) {
      const uint64_t held = *source->remaining() / header_.record_size;
      if (header_.point_count > held) return CutOff(held);
      RILIEVO_RETURN_IF_ERROR(points_.Reserve(header_.point_count));
    }
    for (uint64_t i = 0; i < header_.point_count; ++i) {
      const char* record = source->Take(header_.record_size);
      if (record == nullptr) return CutOff(i);
      AddRecord(record);
      if (!points_.status().ok()) return points_.status();
    }
    return absl::OkStatus();
  }

  absl::Status ReadCompressed(ByteSource* source) {
    RILIEVO_ASSIGN_OR_RETURN(const std::unique_ptr<laz::LazRecords> records,
                             laz::LazRecords::Open(source, header_, records_.laszip, wanted_));
    // Two bytes for a point are little already, what needs less grows as it comes.
    if (source->remaining() && header_.point_count <= *source->remaining() / 2) {
      RILIEVO_RETURN_IF_ERROR(points_.Reserve(header_.point_count));
    }
    for (uint64_t i = 0; i < header_.point_count; ++i) {
      const char* record = records->Next();
      if (record == nullptr) return records->status();
      AddRecord(record);
      if (!points_.status().ok()) return points_.status();
    }
    return records->CheckEnd();
  }

  absl::Status CutOff(uint64_t held) const {
    return absl::DataLossError(absl::StrCat("LAS: the header announces ", header_.point_count,
                                            " points of ", header_.record_size,
                                            " bytes, the file holds ", held, "; truncated file?"));
  }

  void AddRecord(const char* record) {
    if (IsWithheld(record, header_.point_format)) {
      ++withheld_;
      return;
    }
    if (wanted_.last_returns && IsPassed(record, header_.point_format)) {
      ++passed_;
      return;
    }
    std::array<uint16_t, 3> color{};
    for (size_t channel = 0; color_offset_ > 0 && channel < 3; ++channel) {
      color[channel] = LoadAs<uint16_t>(record + color_offset_ + 2 * channel, kSwapLittle);
      largest_channel_ = std::max(largest_channel_, color[channel]);
    }
    if (!points_.Chooses(ClassOf(record, header_.point_format))) return;
    std::array<double, 3> point;
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = LoadAs<int32_t>(record + 4 * axis, kSwapLittle);
      point[axis] = value * header_.scale[axis] + header_.offset[axis];
    }
    points_.Add(point[0], point[1], point[2]);
    if (wanted_.intensity) intensity_.push_back(LoadAs<uint16_t>(record + 12, kSwapLittle));
    if (wanted_.trajectory != nullptr) AddStation(record);
    if (color_offset_ > 0) colors_.push_back(color);
  }

  void AddStation(const char* record) {
    const auto time = LoadAs<double>(record + kLasTimeOffsets[header_.point_format], kSwapLittle);
    const Eigen::Vector3d place = wanted_.trajectory->At(time);
    has_stations_ |= place.allFinite();
    first_time_ = std::min(first_time_, time);
    last_time_ = std::max(last_time_, time);
    sights_.AddStation(place);
  }

  const LasHeader header_;
  const WantedLayers wanted_;
  const size_t color_offset_;
  LasVariableRecords records_;
  PointCollector points_{wanted_};
  std::vector<float> intensity_;
  std::vector<std::array<uint16_t, 3>> colors_;
  uint16_t largest_channel_ = 0;
  SightCollector sights_{wanted_};
  bool has_stations_ = false;  // some point has
  double first_time_ = std::numeric_limits<double>::infinity(), last_time_ = -first_time_;
  uint64_t withheld_ = 0, passed_ = 0;
};

}  // namespace

absl::StatusOr<ScanFile> ReadLasScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const LasHeader header, ReadLasHeader(&source));
  if (wanted.trajectory != nullptr && kLasTimeOffsets[header.point_format] == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("LAS: points of the format ", header.point_format,
                     " have no GPS time, which a trajectory needs; leave it out"));
  }
  LasReader reader(header, wanted);
  RILIEVO_RETURN_IF_ERROR(reader.Read(&source));
  if (!reader.has_points()) {
    return absl::InvalidArgumentError(
        absl::StrCat("LAS: all ", header.point_count, " points are marked as withheld",
                     wanted.last_returns ? ", or are returns before the last" : ""));
  }
  RILIEVO_RETURN_IF_ERROR(reader.CheckTimes());
  return reader.Finish();
}

}  // namespace rilievo
