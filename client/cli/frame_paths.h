// Where the pictures of a turntable go.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

// "DIR/": DIR/frame-000.png and on, DIR is made; "turn-%03d.png": the number in place of %03d. No
// path: all pictures go into one file, `output`. INVALID_ARGUMENT (exit code kUsage) for another %.
absl::StatusOr<std::vector<std::string>> FramePaths(const std::string& output, int frames);

}  // namespace rilievo
