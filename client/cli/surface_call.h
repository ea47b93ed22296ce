// A call that makes a surface, as a command shows it: how far it is, and why it failed.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "client/cli/progress_display.h"
#include "client/cli/time_left.h"
#include "client/library/reconstruction_client.h"

namespace rilievo {

// `remote`: whether the points travel first. `left`: of a scan made by parts, else null.
ReconstructCallbacks ShowProgress(int64_t points, bool remote, TimeLeft* left,
                                  ProgressDisplay* display);

// `input`: what the surface was to be made of. `server`: as named, empty for this process.
absl::Status Explain(const absl::Status& status, const std::string& input,
                     const std::string& server);

}  // namespace rilievo
