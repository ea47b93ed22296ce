// Point Cloud Library files (PCD 0.6, 0.7).
#include <Eigen/Core>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/lzf.h"
#include "client/formats/number_text.h"
#include "client/formats/pcd_words.h"
#include "client/formats/point_collector.h"
#include "client/formats/scalar_type.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

struct PcdField {
  std::string name;
  ScalarType type = ScalarType::kF32;
  uint64_t count = 1;        // values a point
  uint64_t value_index = 0;  // of its first value within a point
  uint64_t byte_offset = 0;  // same, in bytes
  uint64_t bytes() const { return count * ScalarSize(type); }
};

struct PcdHeader {
  std::vector<PcdField> fields;
  uint64_t points = 0;
  uint64_t point_bytes = 0, point_values = 0;
  std::string data;  // ascii, binary, binary_compressed
  // Fields of one value each that are read: x, y, z, then sights.
  std::vector<int> columns;
  SightColumns sights;
  size_t packed_color_at = 0;   // in columns; 0: none
  bool color_is_float = false;  // whose bits are the colour
  Eigen::Vector3d viewpoint = UnknownPlace();
};

std::optional<ScalarType> PcdType(std::string_view type, std::string_view size) {
  constexpr struct {
    const char *type, *size;
    ScalarType scalar;
  } kTypes[] = {{"F", "4", ScalarType::kF32}, {"F", "8", ScalarType::kF64},
                {"I", "1", ScalarType::kI8},  {"I", "2", ScalarType::kI16},
                {"I", "4", ScalarType::kI32}, {"I", "8", ScalarType::kI64},
                {"U", "1", ScalarType::kU8},  {"U", "2", ScalarType::kU16},
                {"U", "4", ScalarType::kU32}, {"U", "8", ScalarType::kU64}};
  for (const auto& known : kTypes) {
    if (type == known.type && size == known.size) return known.scalar;
  }
  return std::nullopt;
}

absl::Status AddFields(const PcdWords& words, PcdHeader* header) {
  const size_t n = words.fields.size();
  if (n == 0) return PcdHeaderError("FIELDS", "missing or empty");
  if (words.size.size() != n || words.type.size() != n ||
      (!words.count.empty() && words.count.size() != n)) {
    return PcdHeaderError("SIZE, TYPE, COUNT",
                          absl::StrCat("each needs ", n, " values, one a field"));
  }
  for (size_t i = 0; i < n; ++i) {
    PcdField field;
    field.name = words.fields[i];
    const std::optional<ScalarType> type = PcdType(words.type[i], words.size[i]);
    if (!type) {
      return PcdHeaderError(
          absl::StrCat("field ", Quoted(field.name)),
          absl::StrCat("TYPE ", Quoted(words.type[i]), " with SIZE ", Quoted(words.size[i]),
                       " is not a known type; known: F 4 8, I and U 1 2 4 8"));
    }
    field.type = *type;
    if (!words.count.empty() &&
        (!ParseCount(words.count[i], &field.count) || field.count > (1u << 20))) {
      return PcdHeaderError(absl::StrCat("field ", Quoted(field.name)),
                            absl::StrCat("COUNT ", Quoted(words.count[i]),
                                         " is not a count; it must be a whole number to 1048576"));
    }
    field.value_index = header->point_values;
    field.byte_offset = header->point_bytes;
    header->point_values += field.count;
    header->point_bytes += field.bytes();
    header->fields.push_back(std::move(field));
  }
  return absl::OkStatus();
}

absl::Status FindAxes(PcdHeader* header) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (size_t axis = 0; axis < 3; ++axis) {
    int found = 0;
    for (size_t i = 0; i < header->fields.size(); ++i) {
      if (header->fields[i].name != kAxes[axis]) continue;
      header->columns.push_back(static_cast<int>(i));
      ++found;
    }
    if (found != 1 || header->fields[header->columns.back()].count != 1) {
      return PcdHeaderError("FIELDS",
                            absl::StrCat("needs exactly one field '", kAxes[axis], "' of COUNT 1"));
    }
  }
  return absl::OkStatus();
}

// The number of the field with a name and one value, -1 for none.
int FindField(const PcdHeader& header, std::string_view name) {
  for (size_t i = 0; i < header.fields.size(); ++i) {
    if (header.fields[i].name == name && header.fields[i].count == 1) return static_cast<int>(i);
  }
  return -1;
}

// PCL packs a colour into the bits 0xaarrggbb of a field. As a float these may not be a number, so
// binary files are read as integers.
void FindPackedColor(bool is_ascii, PcdHeader* header) {
  int number = FindField(*header, "rgb");
  if (number < 0) number = FindField(*header, "rgba");
  if (number < 0) return;
  PcdField& field = header->fields[number];
  if (ScalarSize(field.type) != 4) return;
  if (!is_ascii) field.type = ScalarType::kU32;
  header->color_is_float = field.type == ScalarType::kF32;
  header->packed_color_at = header->columns.size();
  header->columns.push_back(number);
}

std::array<double, 3> UnpackedColor(double value, bool is_float) {
  // Text may hold any number.
  const double limit = is_float ? double{std::numeric_limits<float>::max()} : 0x1p32;
  if (!(std::abs(value) <= limit)) return {std::nan(""), 0, 0};
  const auto bits = is_float ? std::bit_cast<uint32_t>(static_cast<float>(value))
                             : static_cast<uint32_t>(static_cast<int64_t>(value));
  return {double(bits >> 16 & 255), double(bits >> 8 & 255), double(bits & 255)};
}

// The place and the turn (a quaternion) of the sensor. The default is what files without either
// have.
absl::Status FindViewpoint(const std::vector<std::string>& words, PcdHeader* header) {
  if (words.empty()) return absl::OkStatus();
  constexpr std::array<double, 7> kDefault = {0, 0, 0, 1, 0, 0, 0};
  std::array<double, 7> values{};
  const auto refuse = [&](const std::string& what) {
    return PcdHeaderError("VIEWPOINT", absl::StrCat(what,
                                                    "; give the place and the quaternion of the "
                                                    "sensor, 7 numbers, or leave the line out"));
  };
  if (words.size() != values.size()) return refuse(absl::StrCat(words.size(), " values"));
  for (size_t i = 0; i < values.size(); ++i) {
    if (!ParseNumber(words[i], &values[i]).ok() || !std::isfinite(values[i])) {
      return refuse(Quoted(words[i]));
    }
  }
  if (values != kDefault) header->viewpoint = Eigen::Vector3d(values[0], values[1], values[2]);
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> One(absl::string_view entry, const std::vector<std::string>& words) {
  uint64_t value = 0;
  if (words.size() == 1 && ParseCount(words[0], &value)) return value;
  return PcdHeaderError(entry, absl::StrCat(words.empty() ? std::string("missing")
                                                          : Quoted(words[0]) + " is not a count",
                                            "; it must be a whole number from 0 below 2^64"));
}

absl::Status CountPoints(const PcdWords& words, PcdHeader* header) {
  std::optional<uint64_t> grid;
  if (!words.width.empty()) {
    uint64_t height = 1;
    RILIEVO_ASSIGN_OR_RETURN(const uint64_t width, One("WIDTH", words.width));
    if (!words.height.empty()) {
      RILIEVO_ASSIGN_OR_RETURN(height, One("HEIGHT", words.height));
    }
    if (height != 0 && width > UINT64_MAX / height) {
      return PcdHeaderError("WIDTH, HEIGHT", "their product overflows");
    }
    grid = width * height;
  }
  if (words.points.empty() && grid) {
    header->points = *grid;
  } else {
    RILIEVO_ASSIGN_OR_RETURN(header->points, One("POINTS", words.points));
    if (grid && *grid != header->points) {
      return PcdHeaderError("POINTS",
                            absl::StrCat(header->points, " differs from WIDTH x HEIGHT = ", *grid));
    }
  }
  if (header->points == 0) return PcdHeaderError("POINTS", "0, no points");
  return absl::OkStatus();
}

absl::StatusOr<PcdHeader> ReadPcdHeader(ByteSource* source, const WantedLayers& wanted) {
  RILIEVO_ASSIGN_OR_RETURN(const PcdWords words, ReadPcdWords(source));
  PcdHeader header;
  RILIEVO_RETURN_IF_ERROR(AddFields(words, &header));
  RILIEVO_RETURN_IF_ERROR(FindAxes(&header));
  if (wanted.stations) RILIEVO_RETURN_IF_ERROR(FindViewpoint(words.viewpoint, &header));
  const auto find = [&](std::string_view name) { return FindField(header, name); };
  header.sights = SightColumns(wanted, find, &header.columns);
  RILIEVO_RETURN_IF_ERROR(CountPoints(words, &header));
  header.data = words.data[0];
  if (wanted.colors && header.sights.color_column(header.columns) < 0) {
    FindPackedColor(header.data == "ascii", &header);
  }
  if (header.data != "ascii" && header.data != "binary" && header.data != "binary_compressed") {
    return PcdHeaderError("DATA", absl::StrCat("unknown format ", Quoted(header.data),
                                               "; known: ascii, binary, binary_compressed"));
  }
  return header;
}

absl::Status CheckPointsFit(const PcdHeader& header, uint64_t least_bytes, uint64_t held_bytes) {
  const uint64_t held = held_bytes / least_bytes;
  if (header.points <= held) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("PCD data: the header claims ", header.points,
                                          " points, the ", held_bytes, " bytes there hold at most ",
                                          held, "; truncated file or wrong count"));
}

absl::Status Truncated(const PcdHeader& header, uint64_t read) {
  return absl::DataLossError(absl::StrCat("PCD data: the header claims ", header.points,
                                          " points, the bytes end after ", read));
}

// The points so far, with what is read of them besides.
struct PcdPoints {
  PcdPoints(const PcdHeader& header, const WantedLayers& wanted) : points(wanted), sights(wanted) {
    const int red = header.sights.color_column(header.columns);
    sights.set_color_kind(red < 0 ? ColorCollector::Kind::kBytes
                                  : ColorCollector::KindOf(header.fields[red].type));
  }

  // `values`: of the header's columns.
  void Add(const PcdHeader& header, const std::vector<double>& values) {
    if (!header.sights.Take(values.data(), &points, &sights)) return;
    if (!header.sights.has_sensor()) sights.AddStation(header.viewpoint);
    if (header.packed_color_at == 0) return;
    sights.AddColor(UnpackedColor(values[header.packed_color_at], header.color_is_float).data());
  }

  PointCollector points;
  SightCollector sights;
};

absl::Status ReadAscii(ByteSource* source, const PcdHeader& header, PcdPoints* points) {
  if (source->remaining()) {
    RILIEVO_RETURN_IF_ERROR(
        CheckPointsFit(header, 2 * header.point_values, *source->remaining() + 1));
    RILIEVO_RETURN_IF_ERROR(points->points.Reserve(header.points));
  }
  std::vector<uint64_t> columns;
  for (const int field : header.columns) columns.push_back(header.fields[field].value_index);
  std::vector<double> point(columns.size());
  std::string_view line;
  for (uint64_t read = 0; read < header.points;) {
    const ByteSource::Line result = source->NextLine(&line);
    if (result == ByteSource::Line::kEnd) return Truncated(header, read);
    const auto line_error = [&](const auto&... what) {
      return absl::InvalidArgumentError(
          absl::StrCat("PCD data, line ", source->line_number(), ": ", what...));
    };
    if (result == ByteSource::Line::kTooLong) return line_error("the next line is over 1 MiB");
    std::string_view word = NextWord(&line);
    if (word.empty()) continue;
    uint64_t column = 0;
    for (; !word.empty(); word = NextWord(&line), ++column) {
      for (size_t place = 0; place < columns.size(); ++place) {
        if (columns[place] != column) continue;
        if (const absl::Status status = ParseNumber(word, &point[place]); !status.ok()) {
          return line_error(status.message());
        }
      }
    }
    if (column < header.point_values && !source->line_was_ended()) return Truncated(header, read);
    if (column != header.point_values) {
      return line_error(column, " values, the fields need ", header.point_values);
    }
    points->Add(header, point);
    RILIEVO_RETURN_IF_ERROR(points->points.status());
    ++read;
  }
  return absl::OkStatus();
}

absl::Status ReadBinary(ByteSource* source, const PcdHeader& header, PcdPoints* points) {
  if (source->remaining()) {
    RILIEVO_RETURN_IF_ERROR(CheckPointsFit(header, header.point_bytes, *source->remaining()));
    RILIEVO_RETURN_IF_ERROR(points->points.Reserve(header.points));
  }
  std::vector<double> point(header.columns.size());
  const uint64_t block = std::max<uint64_t>(1, (1u << 16) / header.point_bytes);
  for (uint64_t read = 0; read < header.points;) {
    const uint64_t rows = std::min(block, header.points - read);
    const char* bytes = source->Take(rows * header.point_bytes);
    if (bytes == nullptr) return Truncated(header, read);
    for (uint64_t row = 0; row < rows; ++row, bytes += header.point_bytes) {
      for (size_t place = 0; place < point.size(); ++place) {
        const PcdField& field = header.fields[header.columns[place]];
        point[place] = LoadScalar(bytes + field.byte_offset, field.type, kSwapLittle);
      }
      points->Add(header, point);
    }
    RILIEVO_RETURN_IF_ERROR(points->points.status());
    read += rows;
  }
  return absl::OkStatus();
}

// Two sizes, then an LZF stream that holds field after field instead of point after point.
absl::Status ReadCompressed(ByteSource* source, const PcdHeader& header, PcdPoints* points) {
  const char* sizes = source->Take(8);
  if (sizes == nullptr) return absl::DataLossError("PCD data: the bytes end before the two sizes");
  const uint64_t compressed = LoadAs<uint32_t>(sizes, kSwapLittle);
  const uint64_t size = LoadAs<uint32_t>(sizes + 4, kSwapLittle);
  if (header.points > size / header.point_bytes || header.points * header.point_bytes != size) {
    return absl::InvalidArgumentError(
        absl::StrCat("PCD data: ", size, " uncompressed bytes announced, ", header.points,
                     " points of ", header.point_bytes, " bytes need another number"));
  }
  const char* bytes = source->Take(compressed);
  if (bytes == nullptr) {
    return absl::DataLossError(
        absl::StrCat("PCD data: the bytes end before the ", compressed, " announced"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<char> body,
                           DecodeLzf(std::string_view(bytes, compressed), size));
  RILIEVO_RETURN_IF_ERROR(points->points.Reserve(header.points));
  std::vector<double> point(header.columns.size());
  for (uint64_t i = 0; i < header.points; ++i) {
    for (size_t place = 0; place < point.size(); ++place) {
      const PcdField& field = header.fields[header.columns[place]];
      const char* plane = body.data() + field.byte_offset * header.points;
      point[place] = LoadScalar(plane + i * field.bytes(), field.type, kSwapLittle);
    }
    points->Add(header, point);
    RILIEVO_RETURN_IF_ERROR(points->points.status());
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ScanFile> ReadPcdScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const PcdHeader header, ReadPcdHeader(&source, wanted));
  PcdPoints points(header, wanted);
  RILIEVO_RETURN_IF_ERROR(header.data == "ascii"    ? ReadAscii(&source, header, &points)
                          : header.data == "binary" ? ReadBinary(&source, header, &points)
                                                    : ReadCompressed(&source, header, &points));
  ScanFile scan;
  scan.format = absl::StrCat("PCD ", header.data);
  scan.cloud.sights = points.sights.Finish(points.points.count());
  scan.layers.intensity = points.sights.FinishIntensity(points.points.count());
  scan.cloud.points = points.points.Finish();
  scan.class_counts = points.points.class_counts();
  return scan;
}

}  // namespace rilievo
