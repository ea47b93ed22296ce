// Uncompressed LAS 1.0 to 1.4, all point formats.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/las_header.h"
#include "client/formats/point_collector.h"
#include "client/formats/scalar_type.h"
#include "client/formats/scan_reader.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr bool kSwap = std::endian::native == std::endian::big;

// Where the red of a point is, by its format; 0: it has no colours.
constexpr size_t kColorOffsets[] = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};

// "Withheld" points are deleted ones that the file still holds: a bit of the classification in
// formats 0 to 5, of the flags before it in the others.
bool IsWithheld(const char* record, int point_format) {
  const auto flags = static_cast<uint8_t>(record[15]);
  return (flags & (point_format < 6 ? 0x80 : 0x04)) != 0;
}

class LasReader {
 public:
  LasReader(const LasHeader& header, const WantedLayers& wanted)
      : header_(header),
        intensity_wanted_(wanted.intensity),
        color_offset_(wanted.colors ? kColorOffsets[header.point_format] : 0) {}

  absl::Status Read(ByteSource* source) {
    if (!source->Skip(header_.point_offset - header_.header_size)) return CutOff(0);
    if (source->remaining()) {
      const uint64_t held = *source->remaining() / header_.record_size;
      if (header_.point_count > held) return CutOff(held);
      points_.Reserve(header_.point_count);
    }
    for (uint64_t i = 0; i < header_.point_count; ++i) {
      const char* record = source->Take(header_.record_size);
      if (record == nullptr) return CutOff(i);
      if (IsWithheld(record, header_.point_format)) {
        ++withheld_;
      } else {
        AddPoint(record);
      }
    }
    return absl::OkStatus();
  }

  int64_t count() const { return points_.count(); }

  ScanFile Finish() {
    ScanFile scan;
    scan.format =
        absl::StrCat("LAS 1.", header_.minor_version, ", point format ", header_.point_format);
    if (withheld_ > 0) absl::StrAppend(&scan.format, ", without ", withheld_, " withheld points");
    scan.cloud.points = points_.Finish();
    scan.layers.intensity = std::move(intensity_);
    // 16 bits a channel, but many programs write 8.
    const int shift = largest_channel_ > 255 ? 8 : 0;
    scan.layers.colors.reserve(colors_.size());
    for (const std::array<uint16_t, 3>& color : colors_) {
      scan.layers.colors.push_back({static_cast<uint8_t>(color[0] >> shift),
                                    static_cast<uint8_t>(color[1] >> shift),
                                    static_cast<uint8_t>(color[2] >> shift)});
    }
    return scan;
  }

 private:
  absl::Status CutOff(uint64_t held) const {
    return absl::DataLossError(absl::StrCat("LAS: the header announces ", header_.point_count,
                                            " points of ", header_.record_size,
                                            " bytes, the file holds ", held, "; truncated file?"));
  }

  void AddPoint(const char* record) {
    std::array<double, 3> point;
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = LoadAs<int32_t>(record + 4 * axis, kSwap);
      point[axis] = value * header_.scale[axis] + header_.offset[axis];
    }
    points_.Add(point[0], point[1], point[2]);
    if (intensity_wanted_) intensity_.push_back(LoadAs<uint16_t>(record + 12, kSwap));
    if (color_offset_ == 0) return;
    std::array<uint16_t, 3> color;
    for (size_t channel = 0; channel < 3; ++channel) {
      color[channel] = LoadAs<uint16_t>(record + color_offset_ + 2 * channel, kSwap);
      largest_channel_ = std::max(largest_channel_, color[channel]);
    }
    colors_.push_back(color);
  }

  const LasHeader header_;
  const bool intensity_wanted_;
  const size_t color_offset_;
  PointCollector points_;
  std::vector<float> intensity_;
  std::vector<std::array<uint16_t, 3>> colors_;
  uint16_t largest_channel_ = 0;
  uint64_t withheld_ = 0;
};

}  // namespace

absl::StatusOr<ScanFile> ReadLasScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const LasHeader header, ReadLasHeader(&source));
  LasReader reader(header, wanted);
  RILIEVO_RETURN_IF_ERROR(reader.Read(&source));
  if (reader.count() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("LAS: all ", header.point_count, " points are marked as withheld"));
  }
  return reader.Finish();
}

}  // namespace rilievo
