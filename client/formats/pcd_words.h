// The header of a Point Cloud Library file, word by word.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/formats/byte_source.h"

namespace rilievo {

// The words of each header line, as found.
struct PcdWords {
  std::vector<std::string> fields, size, type, count, width, height, points, data, viewpoint;
};

// Up to the DATA line. DATA_LOSS when the bytes end before it, INVALID_ARGUMENT, with the line, for
// an entry that is not known and for headers of more than 1 MiB.
absl::StatusOr<PcdWords> ReadPcdWords(ByteSource* source);

// INVALID_ARGUMENT for an entry of the header.
absl::Status PcdHeaderError(absl::string_view entry, absl::string_view what);

}  // namespace rilievo
