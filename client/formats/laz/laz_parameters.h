// How the points of a LAZ file are compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/formats/las_header.h"

namespace rilievo::laz {

struct LazParameters {
  enum class Coding { kPointwise, kPointwiseChunks, kLayeredChunks };
  Coding coding = Coding::kPointwise;
  // Points of a chunk, or 0 where each chunk has a size of its own.
  uint32_t chunk_points = 0;
  int item_version = 0;    // of the point: 2; 3 and 4 for layers
  size_t extra_bytes = 0;  // behind the fields of the point format

  // Items of a point beside its first 20 (formats 0 to 5) or 30 bytes.
  bool gps_time = false, near_infrared = false, wave_packet = false;
  size_t color_offset = 0;  // in the record; 0: no colours
};

// `record`: that of LASzip (laszip.hpp of LASzip 3; LasVariableRecords). INVALID_ARGUMENT where it
// is missing or not of this point format, or for a compression that is not known.
absl::StatusOr<LazParameters> ReadLazParameters(const std::optional<std::string>& record,
                                                const LasHeader& header);

}  // namespace rilievo::laz
