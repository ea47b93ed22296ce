#include "client/formats/las_variable_records.h"

#include <cstdint>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/crs_text.h"
#include "client/formats/scalar_type.h"

namespace rilievo {
namespace {

constexpr size_t kRecordHeader = 54;
constexpr int kLaszipRecord = 22204, kWktRecord = 2112, kGeoKeysRecord = 34735;
// OGC GeoTIFF 1.1, ProjectedCRSGeoKey and GeodeticCRSGeoKey.
constexpr uint16_t kProjectedKey = 3072, kGeodeticKey = 2048;
constexpr uint16_t kUserDefined = 32767;

const char* NameOf(const LasHeader& header) { return header.compressed ? "LAZ: " : "LAS: "; }

absl::Status CutOff(const LasHeader& header) {
  return absl::DataLossError(
      absl::StrCat(NameOf(header), "the file ends before its points; truncated file?"));
}

// The code of the last key that names one: rows of key, location (0: here), count and value, after
// a first row that ends with their number.
std::string CrsOfGeoKeys(std::string_view content) {
  constexpr size_t kRow = 8;
  uint16_t projected = 0, geodetic = 0;
  for (size_t at = kRow; at + kRow <= content.size(); at += kRow) {
    const auto key = LoadAs<uint16_t>(content.data() + at, kSwapLittle);
    const auto location = LoadAs<uint16_t>(content.data() + at + 2, kSwapLittle);
    const auto value = LoadAs<uint16_t>(content.data() + at + 6, kSwapLittle);
    if (location != 0 || value == 0 || value == kUserDefined) continue;
    if (key == kProjectedKey) projected = value;
    if (key == kGeodeticKey) geodetic = value;
  }
  const uint16_t code = projected > 0 ? projected : geodetic;
  return code > 0 ? absl::StrCat("EPSG:", code) : std::string();
}

class Records {
 public:
  // `user`: 16 bytes, filled up with zeros.
  void Add(std::string_view user, int number, std::string_view content) {
    user = user.substr(0, user.find('\0'));
    if (number == kLaszipRecord && user.substr(0, 14) == "laszip encoded") {
      found_.laszip.emplace(content);
    } else if (user == "LASF_Projection" && number == kWktRecord) {
      wkt_ = CrsText(content.substr(0, content.find('\0')));
    } else if (user == "LASF_Projection" && number == kGeoKeysRecord) {
      found_.crs = CrsOfGeoKeys(content);
    }
  }

  LasVariableRecords Finish() {
    if (!wkt_.empty()) found_.crs = wkt_;
    return std::move(found_);
  }

 private:
  LasVariableRecords found_;
  std::string wkt_;
};

}  // namespace

absl::StatusOr<LasVariableRecords> ReadLasVariableRecords(ByteSource* source,
                                                          const LasHeader& header) {
  if (!source->Skip(header.records_offset - source->position())) return CutOff(header);
  Records records;
  for (uint32_t i = 0; i < header.record_count; ++i) {
    if (source->position() + kRecordHeader > header.point_offset) break;
    const char* record = source->Take(kRecordHeader);
    if (record == nullptr) return CutOff(header);
    const std::string user(record + 2, 16);
    const auto number = LoadAs<uint16_t>(record + 18, kSwapLittle);
    const auto size = LoadAs<uint16_t>(record + 20, kSwapLittle);
    if (source->position() + size > header.point_offset) {
      if (!header.compressed) break;
      return absl::InvalidArgumentError(absl::StrCat(
          NameOf(header), "variable length record ", i + 1, " has ", size,
          " bytes and reaches into the points, which begin at byte ", header.point_offset));
    }
    const char* content = source->Take(size);
    if (content == nullptr) return CutOff(header);
    records.Add(user, number, {content, size});
  }
  if (!source->Skip(header.point_offset - source->position())) return CutOff(header);
  return records.Finish();
}

}  // namespace rilievo
