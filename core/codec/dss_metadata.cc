#include "core/codec/dss_metadata.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace rilievo {
namespace {

// The numbers are part of the format.
enum Field : uint64_t {
  kEnd = 0,
  kGenerator = 1,      // text
  kErrorRms = 2,       // little-endian double
  kErrorMax = 3,       // same
  kScanPoints = 4,     // varint
  kRoad = 5,           // text
  kErrors = 6,         // figures: mean, p95
  kSurfaceToScan = 7,  // figures: rms, mean, p95, max
  kScanToSurface = 8,  // same
  kShares = 9,         // figures: measured, smoothed, filled
  kFolds = 10,         // varint
  kInputHash = 11,     // bytes
  kOptions = 12,       // text
};

void WriteField(Field field, std::span<const uint8_t> bytes, ByteWriter& writer) {
  writer.Varint(field);
  writer.Varint(bytes.size());
  writer.Bytes(bytes);
}

void WriteText(Field field, const std::string& text, ByteWriter& writer) {
  if (!text.empty()) WriteField(field, std::vector<uint8_t>(text.begin(), text.end()), writer);
}

// To 20 binary digits after the first; what is unknown becomes -1.
double Rounded(double figure) {
  if (!(figure >= 0) || !std::isfinite(figure)) return -1;
  constexpr int kDropped = 52 - 20;
  const uint64_t bits = std::bit_cast<uint64_t>(figure) + (uint64_t{1} << (kDropped - 1));
  return std::bit_cast<double>(bits >> kDropped << kDropped);
}

void WriteDouble(Field field, double value, ByteWriter& writer) {
  if (!(value >= 0)) return;
  std::vector<uint8_t> bytes;
  ByteWriter(bytes).F64(value);
  WriteField(field, bytes, writer);
}

void WriteFigures(Field field, std::span<const double> figures, ByteWriter& writer) {
  if (std::all_of(figures.begin(), figures.end(), [](double figure) { return !(figure >= 0); })) {
    return;
  }
  std::vector<uint8_t> bytes;
  ByteWriter inner(bytes);
  for (double figure : figures) inner.ShortF64(Rounded(figure));
  WriteField(field, bytes, writer);
}

void WriteCount(Field field, int64_t count, ByteWriter& writer) {
  std::vector<uint8_t> bytes;
  ByteWriter(bytes).Varint(static_cast<uint64_t>(count));
  WriteField(field, bytes, writer);
}

void WriteDistance(Field field, const DssDistance& d, ByteWriter& writer) {
  WriteFigures(field, std::vector<double>{d.rms, d.mean, d.p95, d.max}, writer);
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
    case kRoad:
      metadata.road = text;
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
  WriteText(kGenerator, metadata.generator, writer);
  if (!FollowsFromWays(metadata)) {
    WriteDouble(kErrorRms, metadata.error_rms, writer);
    WriteDouble(kErrorMax, metadata.error_max, writer);
  }
  if (metadata.scan_points > 0) WriteCount(kScanPoints, metadata.scan_points, writer);
  WriteText(kRoad, metadata.road, writer);
  WriteFigures(kErrors, std::vector<double>{metadata.error_mean, metadata.error_p95}, writer);
  WriteDistance(kSurfaceToScan, metadata.surface_to_scan, writer);
  WriteDistance(kScanToSurface, metadata.scan_to_surface, writer);
  WriteFigures(
      kShares,
      std::vector<double>{metadata.measured_share, metadata.smoothed_share, metadata.filled_share},
      writer);
  if (metadata.folds >= 0) WriteCount(kFolds, metadata.folds, writer);
  WriteText(kInputHash, metadata.input_hash, writer);
  WriteText(kOptions, metadata.options, writer);
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
