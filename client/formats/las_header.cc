#include "client/formats/las_header.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "client/formats/scalar_type.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr bool kSwap = std::endian::native == std::endian::big;
constexpr size_t kShortHeader = 227;  // LAS 1.0 to 1.2
constexpr size_t kLongHeader = 375;   // LAS 1.4
// Bytes of a point by its format, ASPRS LAS 1.4 R15, tables 7 to 17.
constexpr size_t kRecordSizes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
// laszip sets it in the point format.
constexpr uint8_t kCompressed = 0x80;

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
  const size_t record = kRecordSizes[header.point_format];
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
  const auto size = LoadAs<uint16_t>(bytes + 94, kSwap);
  header.point_offset = LoadAs<uint32_t>(bytes + 96, kSwap);
  const auto format = LoadAs<uint8_t>(bytes + 104, false);
  if ((format & kCompressed) != 0) {
    return absl::InvalidArgumentError(
        "this is a LAZ file (compressed LAS), which is not supported; unpack it first, with "
        "LAStools: "
        "laszip -i IN.laz -o OUT.las, or with PDAL (of conda-forge): pdal translate IN.laz "
        "OUT.las");
  }
  header.point_format = format;
  header.record_size = LoadAs<uint16_t>(bytes + 105, kSwap);
  header.point_count = LoadAs<uint32_t>(bytes + 107, kSwap);
  for (int axis = 0; axis < 3; ++axis) {
    header.scale[axis] = LoadAs<double>(bytes + 131 + 8 * axis, kSwap);
    header.offset[axis] = LoadAs<double>(bytes + 155 + 8 * axis, kSwap);
  }
  header.header_size = kShortHeader;
  if (header.minor_version >= 4 && size >= kLongHeader) {
    bytes = source->Take(kLongHeader - kShortHeader);
    if (bytes == nullptr) return CutOff();
    header.header_size = kLongHeader;
    // The legacy count is 0 for the formats from 6 on and beyond 2^32 points.
    const auto count = LoadAs<uint64_t>(bytes + 247 - kShortHeader, kSwap);
    if (count > 0) header.point_count = count;
  }
  RILIEVO_RETURN_IF_ERROR(CheckHeader(header, size));
  return header;
}

}  // namespace rilievo
