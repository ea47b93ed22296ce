// The header of a LAS file: where its points are, and how their coordinates are written.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"

namespace rilievo {

// By point format: the bytes of a point, and where in them its red is (0: it has no colours). ASPRS
// LAS 1.4 R15, tables 7 to 17.
inline constexpr size_t kLasRecordSizes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
inline constexpr size_t kLasColorOffsets[] = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};

// Where in a point its GPS time is, a double (0: it has none).
inline constexpr size_t kLasTimeOffsets[] = {0, 20, 0, 20, 20, 20, 22, 22, 22, 22, 22};

// ASPRS LAS 1.0 to 1.4.
struct LasHeader {
  int minor_version = 0;
  int point_format = 0;     // 0 to 10
  bool compressed = false;  // LAZ
  uint64_t point_offset = 0;
  uint64_t records_offset = 0;  // of the variable length records
  uint32_t record_count = 0;    // of them
  size_t record_size = 0;
  uint64_t point_count = 0;
  std::array<double, 3> scale{}, offset{};  // coordinate = integer * scale + offset
};

// Reads the header and no more. The counts are as claimed: nothing is allocated for them.
// INVALID_ARGUMENT for a field out of range, DATA_LOSS for a header that is cut off.
absl::StatusOr<LasHeader> ReadLasHeader(ByteSource* source);

}  // namespace rilievo
