#include "client/formats/las_header.h"

#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "client/formats/scalar_type.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kShortHeader = 227;  // LAS 1.0 to 1.2
constexpr size_t kLongHeader = 375;   // LAS 1.4
// LASzip sets it in the point format, and may set the bit below.
constexpr uint8_t kCompressed = 0x80;
constexpr uint8_t kPointFormat = 0x3f;

template <typename... What>
absl::Status Invalid(const What&... what) {
  return absl::InvalidArgumentError(absl::StrCat("LAS header: ", what...));
}

absl::Status CutOff() {
  return absl::DataLossError("LAS: the file ends within its header; truncated file?");
}

absl::Status CheckHeader(const LasHeader& header, uint16_t size) {
  const size_t least = header.minor_version >= 4 ? kLongHeader : kShortHeader;
  if (size < least) {
    return Invalid("a size of ", size, " bytes, LAS 1.", header.minor_version, " needs ", least);
  }
  if (header.point_format > 10) {
    return Invalid("point format ", header.point_format, ", known are 0 to 10");
  }
  const size_t record = kLasRecordSizes[header.point_format];
  if (header.record_size < record) {
    return Invalid("points of ", header.record_size, " bytes, point format ", header.point_format,
                   " needs ", record);
  }
  if (header.point_offset < size) {
    return Invalid("the points begin at byte ", header.point_offset, ", within the header of ",
                   size, " bytes");
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isfinite(header.scale[axis]) && header.scale[axis] != 0 &&
        std::isfinite(header.offset[axis])) {
      continue;
    }
    return Invalid("scale ", header.scale[axis], " and offset ", header.offset[axis], " of ",
                   std::string(1, static_cast<char>('x' + axis)),
                   "; the scale must be finite and not 0, the offset finite");
  }
  if (header.point_count == 0) return Invalid("0 points, the file holds none");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<LasHeader> ReadLasHeader(ByteSource* source) {
  const char* bytes = source->Take(kShortHeader);
  if (bytes == nullptr) return CutOff();
  if (std::memcmp(bytes, "LASF", 4) != 0) return Invalid("does not begin with LASF");
  LasHeader header;
  const int major = LoadAs<uint8_t>(bytes + 24, false);
  header.minor_version = LoadAs<uint8_t>(bytes + 25, false);
  if (major != 1 || header.minor_version > 4) {
    return Invalid("version ", major, ".", header.minor_version, ", known are 1.0 to 1.4");
  }
  const auto size = LoadAs<uint16_t>(bytes + 94, kSwapLittle);
  header.records_offset = size;
  header.point_offset = LoadAs<uint32_t>(bytes + 96, kSwapLittle);
  header.record_count = LoadAs<uint32_t>(bytes + 100, kSwapLittle);
  const auto format = LoadAs<uint8_t>(bytes + 104, false);
  header.compressed = (format & kCompressed) != 0;
  header.point_format = header.compressed ? format & kPointFormat : format;
  header.record_size = LoadAs<uint16_t>(bytes + 105, kSwapLittle);
  header.point_count = LoadAs<uint32_t>(bytes + 107, kSwapLittle);
  for (int axis = 0; axis < 3; ++axis) {
    header.scale[axis] = LoadAs<double>(bytes + 131 + 8 * axis, kSwapLittle);
    header.offset[axis] = LoadAs<double>(bytes + 155 + 8 * axis, kSwapLittle);
  }
  if (header.minor_version >= 4 && size >= kLongHeader) {
    bytes = source->Take(kLongHeader - kShortHeader);
    if (bytes == nullptr) return CutOff();
    // The legacy count is 0 for the formats from 6 on and beyond 2^32 points.
    const auto count = LoadAs<uint64_t>(bytes + 247 - kShortHeader, kSwapLittle);
    if (count > 0) header.point_count = count;
  }
  RILIEVO_RETURN_IF_ERROR(CheckHeader(header, size));
  return header;
}

}  // namespace rilievo
