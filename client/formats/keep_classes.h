// The points of some classes alone.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "client/formats/scan_reader.h"

namespace rilievo {

// Drops all other points, and scan->classes. INVALID_ARGUMENT when not each point has a class, or
// none has one of these: the message names the classes that there are.
absl::Status KeepClasses(std::span<const uint8_t> classes, ScanFile* scan);

}  // namespace rilievo
