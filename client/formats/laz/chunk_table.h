// The table of the chunks at the end of a LAZ file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo::laz {

// The numbers of points of chunks of different sizes. `file`: all bytes from the position `begin`
// of the chunks on; `table`: the position of the table, or -1 where the last 8 bytes tell it;
// `record_size`: bytes of a point as it is, which each chunk begins with. DATA_LOSS for a table
// that is missing, cut off or impossible.
absl::StatusOr<std::vector<uint32_t>> ReadChunkTable(std::string_view file, uint64_t begin,
                                                     int64_t table, size_t record_size);

}  // namespace rilievo::laz
