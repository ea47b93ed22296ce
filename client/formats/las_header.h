// The header of a LAS file: where its points are, and how their coordinates are written.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"

namespace rilievo {

// ASPRS LAS 1.0 to 1.4.
struct LasHeader {
  int minor_version = 0;
  int point_format = 0;      // 0 to 10
  uint64_t header_size = 0;  // bytes consumed by ReadLasHeader
  uint64_t point_offset = 0;
  size_t record_size = 0;
  uint64_t point_count = 0;
  std::array<double, 3> scale{}, offset{};  // coordinate = integer * scale + offset
};

// Reads the header and no more. The counts are as claimed: nothing is allocated for them.
// INVALID_ARGUMENT for a field out of range and for LAZ, DATA_LOSS for a header that is cut off.
absl::StatusOr<LasHeader> ReadLasHeader(ByteSource* source);

}  // namespace rilievo
