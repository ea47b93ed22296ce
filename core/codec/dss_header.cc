#include "core/codec/dss_header.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/codec/byte_stream.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

constexpr uint64_t kMaxCount = 1 << 28;
constexpr uint8_t kHasBoundaryFlag = 1;

// Metadata fields: number, length, bytes. A decoder skips the numbers it does not know.
enum MetadataField : uint64_t {
  kEnd = 0,
  kGenerator = 1,   // text
  kErrorRms = 2,    // double
  kErrorMax = 3,    // double
  kScanPoints = 4,  // varint
  kRoad = 5,        // text
};

void WriteField(MetadataField field, const std::vector<uint8_t>& bytes, ByteWriter& writer) {
  writer.Varint(field);
  writer.Varint(bytes.size());
  writer.Bytes(bytes);
}

void WriteText(MetadataField field, const std::string& text, ByteWriter& writer) {
  if (!text.empty()) WriteField(field, std::vector<uint8_t>(text.begin(), text.end()), writer);
}

void WriteDouble(MetadataField field, double value, ByteWriter& writer) {
  if (!(value >= 0)) return;  // unknown
  std::vector<uint8_t> bytes;
  ByteWriter(bytes).F64(value);
  WriteField(field, bytes, writer);
}

void WriteMetadata(const DssMetadata& metadata, ByteWriter& writer) {
  WriteText(kGenerator, metadata.generator, writer);
  WriteDouble(kErrorRms, metadata.error_rms, writer);
  WriteDouble(kErrorMax, metadata.error_max, writer);
  if (metadata.scan_points > 0) {
    std::vector<uint8_t> bytes;
    ByteWriter(bytes).Varint(static_cast<uint64_t>(metadata.scan_points));
    WriteField(kScanPoints, bytes, writer);
  }
  WriteText(kRoad, metadata.road, writer);
  writer.Varint(kEnd);
}

DssMetadata ReadMetadata(ByteReader& reader) {
  DssMetadata metadata;
  while (reader.ok()) {
    const uint64_t field = reader.Varint();
    if (field == kEnd) break;
    const std::span<const uint8_t> bytes = reader.Bytes(reader.Varint());
    ByteReader value(bytes);
    switch (field) {
      case kGenerator:
        metadata.generator.assign(bytes.begin(), bytes.end());
        break;
      case kErrorRms:
        metadata.error_rms = value.F64();
        break;
      case kErrorMax:
        metadata.error_max = value.F64();
        break;
      case kScanPoints:
        metadata.scan_points = static_cast<int64_t>(value.Varint());
        break;
      case kRoad:
        metadata.road.assign(bytes.begin(), bytes.end());
        break;
      default:
        break;
    }
  }
  return metadata;
}

}  // namespace

std::vector<uint8_t> EncodeDssHeader(const DssHeader& header) {
  std::vector<uint8_t> bytes;
  ByteWriter writer(bytes);
  writer.Byte(header.has_boundary ? kHasBoundaryFlag : 0);
  writer.Varint(static_cast<uint64_t>(header.vertex_count));
  writer.Varint(static_cast<uint64_t>(header.face_count));
  writer.Byte(static_cast<uint8_t>(header.max_level));
  for (int axis = 0; axis < 3; ++axis) writer.F64(header.frame.center[axis]);
  writer.F64(header.frame.diagonal);
  writer.F64(header.position_step);
  writer.F64(header.height_step);
  WriteMetadata(header.metadata, writer);
  return bytes;
}

absl::StatusOr<DssHeader> DecodeDssHeader(std::span<const uint8_t> bytes) {
  ByteReader reader(bytes);
  DssHeader header;
  const uint8_t flags = reader.Byte();
  header.has_boundary = (flags & kHasBoundaryFlag) != 0;
  const uint64_t vertex_count = reader.Varint(), face_count = reader.Varint();
  header.max_level = reader.Byte();
  for (int axis = 0; axis < 3; ++axis) header.frame.center[axis] = reader.F64();
  header.frame.diagonal = reader.F64();
  header.position_step = reader.F64();
  header.height_step = reader.F64();
  header.metadata = ReadMetadata(reader);
  if (!reader.ok()) return absl::DataLossError("the header ends before its last field");
  if ((flags & ~kHasBoundaryFlag) != 0) {
    return absl::DataLossError(absl::StrCat("the header has unknown flags, ", flags));
  }
  if (vertex_count < 3 || vertex_count > kMaxCount || face_count < 1 || face_count > kMaxCount) {
    return absl::DataLossError(absl::StrCat("the header counts ", vertex_count, " vertices and ",
                                            face_count, " faces: not possible"));
  }
  header.vertex_count = static_cast<int>(vertex_count);
  header.face_count = static_cast<int>(face_count);
  if (header.max_level > kMaxLoopLevel) {
    return absl::DataLossError(
        absl::StrCat("max_level is ", header.max_level, ", the format ends at ", kMaxLoopLevel));
  }
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!header.frame.center.allFinite() || !positive(header.frame.diagonal) ||
      !positive(header.position_step) || !positive(header.height_step)) {
    return absl::DataLossError("the header's frame or steps are not finite and positive");
  }
  return header;
}

}  // namespace rilievo
