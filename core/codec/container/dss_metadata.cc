#include "core/codec/container/dss_metadata.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// The numbers are part of the format.
enum Field : uint64_t {
  kEnd = 0,
  kGenerator = 1,       // text
  kErrorRms = 2,        // little-endian double
  kErrorMax = 3,        // same
  kScanPoints = 4,      // varint
  kTopologyText = 5,    // text
  kErrors = 6,          // figures: mean, p95
  kSurfaceToScan = 7,   // figures: rms, mean, p95, max
  kScanToSurface = 8,   // same
  kShares = 9,          // figures: measured, smoothed, filled
  kFolds = 10,          // varint
  kInputHash = 11,      // bytes
  kOptions = 12,        // text
  kFigures = 13,        // small figures, 2 bytes each: ListedFigures
  kRelease = 14,        // three varints: generator "rilievo A.B.C"
  kNamedTopology = 15,  // one byte: place in kTopologies
  kAllSmoothed = 16,    // nothing: it is there
  kPlainLevels = 17,    // a rule a byte
  kOrigin = 18,         // release, topology, scan points, folds, hash in one
  kShortOptions = 19,   // text with bytes for kOptionNames
  kUnit = 20,           // figure: metres per unit of the scan
  kUp = 21,             // one byte: place in UpDirection, from 0 for kX
  kCrs = 22,            // text
  kColors = 23,         // figures, one a channel; nine signed bytes: ColorCode
};
constexpr std::array<std::string_view, 4> kTopologies = {"planar", "spherical", "arbitrary",
                                                         "user"};

// Byte i + 1 of short options stands for name i, with the blank before and the sign after it.
constexpr std::array<std::string_view, 9> kOptionNames = {"max_error", "max_bytes",    "seed",
                                                          "max_level", "target_faces", "boundary",
                                                          "creases",   "topology",     "method"};

// Figures of a certificate in the order of the format; unknown ones at the end are left off.
template <typename Metadata>
auto ListedFigures(Metadata& m) {
  auto &to = m.surface_to_scan, &from = m.scan_to_surface;
  return std::array{&m.measured_share, &m.smoothed_share, &m.filled_share, &to.rms,
                    &to.mean,          &to.p95,           &to.max,         &from.rms,
                    &from.mean,        &from.p95,         &from.max,       &m.error_mean,
                    &m.error_p95,      &m.error_across};
}

// A small figure: 5 bits of exponent over 11 of a mantissa; from 2^-40 to 4, 0xffff for unknown.
constexpr uint32_t kUnknownFigure = 0xffff;
uint32_t SmallFigure(double figure) {
  if (!(figure >= 0)) return kUnknownFigure;
  if (figure == 0) return 0;
  int exponent = 0;  // figure = fraction * 2^exponent, fraction in [1/2, 1)
  std::frexp(figure, &exponent);
  exponent = std::max(exponent + 29, 1);
  const double mantissa = std::nearbyint(std::ldexp(figure, 41 - exponent));
  const double code = (exponent - 1) * 2048.0 + mantissa;  // a mantissa of 4096 carries over
  return static_cast<uint32_t>(std::min(code, kUnknownFigure - 1.0));
}
double FigureOf(uint32_t code) {
  if (code == kUnknownFigure) return -1;
  const uint32_t exponent = code >> 11, mantissa = code & 2047;
  if (exponent == 0) return std::ldexp(mantissa, -40);
  return std::ldexp(2048 + mantissa, static_cast<int>(exponent) - 41);
}

void WriteField(Field field, std::span<const uint8_t> bytes, ByteWriter& writer) {
  writer.Varint(field);
  writer.Varint(bytes.size());
  writer.Bytes(bytes);
}

void WriteText(Field field, const std::string& text, ByteWriter& writer) {
  if (!text.empty()) WriteField(field, std::vector<uint8_t>(text.begin(), text.end()), writer);
}

void WriteDouble(Field field, double value, ByteWriter& writer) {
  if (!(value >= 0)) return;
  std::vector<uint8_t> bytes;
  ByteWriter(bytes).F64(value);
  WriteField(field, bytes, writer);
}

void WriteFigures(const DssMetadata& metadata, ByteWriter& writer) {
  std::vector<uint8_t> bytes;
  ByteWriter inner(bytes);
  size_t known = 0;
  for (const double* figure : ListedFigures(metadata)) {
    const uint32_t code = SmallFigure(*figure);
    inner.Byte(static_cast<uint8_t>(code));
    inner.Byte(static_cast<uint8_t>(code >> 8));
    if (code != kUnknownFigure) known = bytes.size();
  }
  if (known > 0) WriteField(kFigures, std::span(bytes).first(known), writer);
}

void ReadFigures(ByteReader& reader, DssMetadata& metadata) {
  for (double* figure : ListedFigures(metadata)) {
    if (reader.remaining() < 2) return;
    const uint32_t low = reader.Byte();
    *figure = FigureOf(low | static_cast<uint32_t>(reader.Byte()) << 8);
  }
}

// A, B and C of "rilievo A.B.C"; nothing for another generator.
std::vector<uint8_t> ReleaseOf(const std::string& generator) {
  constexpr std::string_view kName = "rilievo ";
  std::vector<uint8_t> bytes;
  ByteWriter inner(bytes);
  std::string again(kName);
  const char* at = generator.data() + std::min(generator.size(), kName.size());
  const char* const end = generator.data() + generator.size();
  for (int i = 0; i < 3; ++i) {
    uint32_t number = 0;
    at = std::from_chars(at, end, number).ptr;
    if (at != end) ++at;
    inner.Varint(number);
    absl::StrAppend(&again, i > 0 ? "." : "", number);
  }
  if (again != generator) bytes.clear();
  return bytes;
}

void WriteGenerator(const std::string& generator, ByteWriter& writer) {
  const std::vector<uint8_t> release = ReleaseOf(generator);
  if (release.empty()) return WriteText(kGenerator, generator, writer);
  WriteField(kRelease, release, writer);
}

std::string ReadRelease(ByteReader& reader) {
  std::string generator = "rilievo ";
  for (int i = 0; i < 3; ++i) absl::StrAppend(&generator, i > 0 ? "." : "", reader.Varint());
  return reader.ok() ? generator : std::string();
}

std::string ReadShortOptions(std::string_view text) {
  std::string options;
  for (const char c : text) {
    const auto code = static_cast<uint8_t>(c);
    if (code == 0 || code > kOptionNames.size()) {
      options += c;
    } else {
      if (!options.empty()) options += ' ';
      options += kOptionNames[code - 1];
      options += '=';
    }
  }
  return options;
}

void WriteTopology(const std::string& topology, ByteWriter& writer) {
  const auto at = std::find(kTopologies.begin(), kTopologies.end(), topology);
  if (at == kTopologies.end()) return WriteText(kTopologyText, topology, writer);
  WriteField(kNamedTopology, std::array{static_cast<uint8_t>(at - kTopologies.begin())}, writer);
}

void WriteCount(Field field, int64_t count, ByteWriter& writer) {
  std::vector<uint8_t> bytes;
  ByteWriter(bytes).Varint(static_cast<uint64_t>(count));
  WriteField(field, bytes, writer);
}

// What nearly every file holds, without a number and a length for each.
bool WriteOrigin(const DssMetadata& metadata, ByteWriter& writer) {
  std::vector<uint8_t> bytes = ReleaseOf(metadata.generator);
  const auto topology = std::find(kTopologies.begin(), kTopologies.end(), metadata.topology);
  if (bytes.empty() || topology == kTopologies.end() || metadata.scan_points <= 0 ||
      metadata.folds < 0 || metadata.input_hash.empty()) {
    return false;
  }
  ByteWriter inner(bytes);
  inner.Byte(static_cast<uint8_t>(topology - kTopologies.begin()));
  inner.Varint(static_cast<uint64_t>(metadata.scan_points));
  inner.Varint(static_cast<uint64_t>(metadata.folds));
  bytes.insert(bytes.end(), metadata.input_hash.begin(), metadata.input_hash.end());
  WriteField(kOrigin, bytes, writer);
  return true;
}

void ReadOrigin(ByteReader& reader, DssMetadata& metadata) {
  const std::string generator = ReadRelease(reader);
  const size_t topology = reader.Byte();
  const uint64_t points = reader.Varint(), folds = reader.Varint();
  if (!reader.ok()) return;
  metadata.generator = generator;
  if (topology < kTopologies.size()) metadata.topology = kTopologies[topology];
  metadata.scan_points = static_cast<int64_t>(points);
  metadata.folds = static_cast<int64_t>(folds);
  const std::span<const uint8_t> hash = reader.Bytes(reader.remaining());
  metadata.input_hash.assign(hash.begin(), hash.end());
}

void WriteOptions(const std::string& options, ByteWriter& writer) {
  const std::string_view all = options;
  std::string text;
  for (size_t begin = 0; begin < all.size();) {
    const size_t end = std::min(all.find(' ', begin), all.size());
    const std::string_view word = all.substr(begin, end - begin);
    const size_t sign = std::min(word.find('='), word.size());
    const auto name = std::find(kOptionNames.begin(), kOptionNames.end(), word.substr(0, sign));
    if (sign < word.size() && name != kOptionNames.end()) {
      text += static_cast<char>(name - kOptionNames.begin() + 1);
      text += word.substr(sign + 1);
    } else {
      if (begin > 0) text += ' ';
      text += word;
    }
    begin = end + 1;
  }
  const bool reads_back = ReadShortOptions(text) == options;
  WriteText(reads_back ? kShortOptions : kOptions, reads_back ? text : options, writer);
}

void WritePlace(const ScanPlace& place, ByteWriter& writer) {
  if (place.metres_per_unit > 0) {
    std::vector<uint8_t> bytes;
    ByteWriter(bytes).ShortF64(place.metres_per_unit);
    WriteField(kUnit, bytes, writer);
  }
  if (place.up != UpDirection::kUnknown) {
    WriteField(kUp, std::array{static_cast<uint8_t>(static_cast<int>(place.up) - 1)}, writer);
  }
  WriteText(kCrs, place.crs, writer);
}

void ReadUnit(ByteReader& reader, ScanPlace& place) {
  const double metres = reader.ShortF64();
  if (reader.ok() && std::isfinite(metres) && metres > 0) place.metres_per_unit = metres;
}

void ReadUp(ByteReader& reader, ScanPlace& place) {
  const int direction = reader.Byte() + 1;
  if (reader.ok() && direction <= static_cast<int>(UpDirection::kMinusZ)) {
    place.up = static_cast<UpDirection>(direction);
  }
}

void ReadDistance(ByteReader& reader, DssDistance& distance) {
  for (double* figure : {&distance.rms, &distance.mean, &distance.p95, &distance.max}) {
    *figure = reader.ShortF64();
  }
}

void ReadField(uint64_t field, std::span<const uint8_t> bytes, DssMetadata& metadata) {
  const std::string text(bytes.begin(), bytes.end());
  ByteReader value(bytes);
  switch (field) {
    case kGenerator:
      metadata.generator = text;
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
    case kTopologyText:
      metadata.topology = text;
      break;
    case kErrors:
      metadata.error_mean = value.ShortF64();
      metadata.error_p95 = value.ShortF64();
      break;
    case kSurfaceToScan:
      ReadDistance(value, metadata.surface_to_scan);
      break;
    case kScanToSurface:
      ReadDistance(value, metadata.scan_to_surface);
      break;
    case kShares:
      metadata.measured_share = value.ShortF64();
      metadata.smoothed_share = value.ShortF64();
      metadata.filled_share = value.ShortF64();
      break;
    case kFolds:
      metadata.folds = static_cast<int64_t>(value.Varint());
      break;
    case kInputHash:
      metadata.input_hash = text;
      break;
    case kOptions:
      metadata.options = text;
      break;
    case kFigures:
      ReadFigures(value, metadata);
      break;
    case kRelease:
      metadata.generator = ReadRelease(value);
      break;
    case kNamedTopology: {
      const size_t topology = value.Byte();
      if (value.ok() && topology < kTopologies.size()) metadata.topology = kTopologies[topology];
      break;
    }
    case kOrigin:
      ReadOrigin(value, metadata);
      break;
    case kShortOptions:
      metadata.options = ReadShortOptions(text);
      break;
    case kUnit:
      ReadUnit(value, metadata.place);
      break;
    case kUp:
      ReadUp(value, metadata.place);
      break;
    case kCrs:
      if (text.size() <= kMaxCrsBytes) metadata.place.crs = text;
      break;
    case kColors:
      metadata.colors = ReadColorCode(value);
      break;
    case kPlainLevels:
      metadata.plain_levels.assign(bytes.begin(), bytes.end());
      break;
    case kAllSmoothed:
      metadata.all_smoothed = true;
      break;
    default:
      break;
  }
}

// RMS and maximum of both ways together follow from those of each way.
bool HasBothWays(const DssMetadata& metadata) {
  return metadata.surface_to_scan.rms >= 0 && metadata.scan_to_surface.rms >= 0;
}

double RmsOfWays(const DssMetadata& metadata) {
  const double a = metadata.surface_to_scan.rms, b = metadata.scan_to_surface.rms;
  return std::sqrt((a * a + b * b) / 2);
}

double MaxOfWays(const DssMetadata& metadata) {
  return std::max(metadata.surface_to_scan.max, metadata.scan_to_surface.max);
}

bool FollowsFromWays(const DssMetadata& metadata) {
  constexpr double kRounding = 1e-6;
  const auto near = [](double x, double y) { return std::abs(x - y) <= kRounding * y; };
  return HasBothWays(metadata) && near(metadata.error_rms, RmsOfWays(metadata)) &&
         near(metadata.error_max, MaxOfWays(metadata));
}

}  // namespace

void WriteMetadata(const DssMetadata& metadata, ByteWriter& writer) {
  const bool in_one = WriteOrigin(metadata, writer);
  if (!in_one) WriteGenerator(metadata.generator, writer);
  if (!FollowsFromWays(metadata)) {
    WriteDouble(kErrorRms, metadata.error_rms, writer);
    WriteDouble(kErrorMax, metadata.error_max, writer);
  }
  WriteFigures(metadata, writer);
  if (!in_one) {
    if (metadata.scan_points > 0) WriteCount(kScanPoints, metadata.scan_points, writer);
    WriteTopology(metadata.topology, writer);
    if (metadata.folds >= 0) WriteCount(kFolds, metadata.folds, writer);
    WriteText(kInputHash, metadata.input_hash, writer);
  }
  WriteOptions(metadata.options, writer);
  WritePlace(metadata.place, writer);
  if (metadata.colors.is_known()) WriteField(kColors, WriteColorCode(metadata.colors), writer);
  if (!metadata.plain_levels.empty()) WriteField(kPlainLevels, metadata.plain_levels, writer);
  if (metadata.all_smoothed) WriteField(kAllSmoothed, {}, writer);
  writer.Varint(kEnd);
}

DssMetadata ReadMetadata(ByteReader& reader) {
  DssMetadata metadata;
  while (reader.ok()) {
    const uint64_t field = reader.Varint();
    if (field == kEnd) break;
    ReadField(field, reader.Bytes(reader.Varint()), metadata);
  }
  if (HasBothWays(metadata)) {
    if (metadata.error_rms < 0) metadata.error_rms = RmsOfWays(metadata);
    if (metadata.error_max < 0) metadata.error_max = MaxOfWays(metadata);
  }
  return metadata;
}

}  // namespace rilievo
