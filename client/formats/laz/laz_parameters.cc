#include "client/formats/laz/laz_parameters.h"

#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/laz/record_fields.h"
#include "core/base/status_macros.h"

namespace rilievo::laz {
namespace {

using Coding = LazParameters::Coding;

constexpr size_t kFixedPart = 34;
constexpr size_t kItemBytes = 6;

// Kinds of items, as LASzip numbers them.
enum : uint16_t {
  kByte = 0,
  kPoint10 = 6,
  kGpsTime11 = 7,
  kRgb12 = 8,
  kWavePacket13 = 9,
  kPoint14 = 10,
  kRgb14 = 11,
  kRgbNir14 = 12,
  kWavePacket14 = 13,
  kByte14 = 14,
};

struct Item {
  uint16_t kind = 0;
  size_t size = 0;
  int version = 0;
};

template <typename... What>
absl::Status Invalid(const What&... what) {
  return absl::InvalidArgumentError(absl::StrCat("LAZ: ", what...));
}

// The items of a point of this format, the extra bytes last.
std::vector<Item> ItemsOf(const LazParameters& parameters, bool layered) {
  std::vector<Item> items = {layered ? Item{kPoint14, 30} : Item{kPoint10, 20}};
  if (parameters.gps_time) items.push_back({kGpsTime11, 8});
  if (parameters.near_infrared) {
    items.push_back({kRgbNir14, 8});
  } else if (parameters.color_offset > 0) {
    items.push_back({layered ? kRgb14 : kRgb12, 6});
  }
  if (parameters.wave_packet) items.push_back({layered ? kWavePacket14 : kWavePacket13, 29});
  if (parameters.extra_bytes > 0) {
    items.push_back({layered ? kByte14 : kByte, parameters.extra_bytes});
  }
  return items;
}

absl::Status CheckItems(const std::string& record, const LasHeader& header,
                        LazParameters* parameters) {
  const bool layered = parameters->coding == Coding::kLayeredChunks;
  const std::vector<Item> expected = ItemsOf(*parameters, layered);
  const auto count = Load<uint16_t>(record.data() + 32);
  if (count != expected.size() || record.size() < kFixedPart + kItemBytes * count) {
    return Invalid("the LASzip record lists ", count, " items in ", record.size(),
                   " bytes, point format ", header.point_format, " of ", header.record_size,
                   " bytes has ", expected.size());
  }
  for (size_t i = 0; i < count; ++i) {
    const char* bytes = record.data() + kFixedPart + kItemBytes * i;
    const Item item = {Load<uint16_t>(bytes), Load<uint16_t>(bytes + 2), Load<uint16_t>(bytes + 4)};
    if (item.kind != expected[i].kind || item.size != expected[i].size) {
      return Invalid("item ", i + 1, " of the LASzip record is of kind ", item.kind, " with ",
                     item.size, " bytes, point format ", header.point_format, " has kind ",
                     expected[i].kind, " with ", expected[i].size, " there");
    }
    if (i == 0) parameters->item_version = item.version;
    const bool known = layered                      ? item.version == 3 || item.version == 4
                       : item.kind == kWavePacket13 ? item.version == 1
                                                    : item.version == 2;
    if (!known || (layered && item.version != parameters->item_version)) {
      return Invalid("item ", i + 1, " of the LASzip record has version ", item.version,
                     ", known are ", layered ? "3 and 4, the same for all items" : "2",
                     "; write the file again with a LASzip of 2011 or later");
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<LazParameters> ReadLazParameters(const std::optional<std::string>& record,
                                                const LasHeader& header) {
  if (!record || record->size() < kFixedPart) {
    return Invalid("the points are compressed, but the record of LASzip that says how is ",
                   record ? "too short" : "missing");
  }
  LazParameters parameters;
  const auto compressor = Load<uint16_t>(record->data());
  const auto coder = Load<uint16_t>(record->data() + 2);
  if (compressor < 1 || compressor > 3 || coder != 0) {
    return Invalid("compressor ", compressor, " with coder ", coder,
                   ", known are the compressors 1 to 3 with coder 0");
  }
  parameters.coding = compressor == 1   ? Coding::kPointwise
                      : compressor == 2 ? Coding::kPointwiseChunks
                                        : Coding::kLayeredChunks;
  if ((header.point_format >= 6) != (compressor == 3)) {
    return Invalid("compressor ", compressor, " for point format ", header.point_format,
                   "; formats 6 to 10 have compressor 3, the others 1 or 2");
  }
  parameters.chunk_points = Load<uint32_t>(record->data() + 12);
  if (parameters.chunk_points == 0xffffffff) parameters.chunk_points = 0;
  const auto format = static_cast<size_t>(header.point_format);
  parameters.gps_time = format == 1 || (format >= 3 && format <= 5);
  parameters.near_infrared = format == 8 || format == 10;
  parameters.wave_packet = format == 4 || format == 5 || format >= 9;
  parameters.color_offset = kLasColorOffsets[format];
  parameters.extra_bytes = header.record_size - kLasRecordSizes[format];
  RILIEVO_RETURN_IF_ERROR(CheckItems(*record, header, &parameters));
  return parameters;
}

}  // namespace rilievo::laz
