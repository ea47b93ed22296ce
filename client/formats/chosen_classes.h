// The points of some classes alone.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "client/formats/scan_reader.h"

namespace rilievo {

// Says in the scan's format how many of its points have these classes. INVALID_ARGUMENT when not
// each point has a class, or none has one of these: the message names the classes that there are.
absl::Status TellChosen(std::span<const uint8_t> classes, ScanFile* scan);

}  // namespace rilievo
