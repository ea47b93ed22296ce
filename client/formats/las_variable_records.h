// What stands between the header of a LAS file and its points.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"
#include "client/formats/las_header.h"

namespace rilievo {

// Of the variable length records (ASPRS LAS 1.4 R15, section 2.5) those that are used.
struct LasVariableRecords {
  std::optional<std::string> laszip;  // user "laszip encoded", record 22204
  // Coordinate reference system: the well-known text (user "LASF_Projection", record 2112), else
  // "EPSG:" and the code of the GeoTIFF keys (record 34735; of the projected system, else of the
  // geographic one). Empty: unknown. Extended records, behind the points, are not read.
  std::string crs;
};

// Reads on to the first point. DATA_LOSS for a file that is cut off. A record that reaches into the
// points ends the list; INVALID_ARGUMENT in a compressed file, which needs its records.
absl::StatusOr<LasVariableRecords> ReadLasVariableRecords(ByteSource* source,
                                                          const LasHeader& header);

}  // namespace rilievo
