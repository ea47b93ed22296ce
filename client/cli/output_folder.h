// A folder that gets several files.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

// Whether an output is one: it exists, or ends with '/'.
bool NamesAFolder(const std::string& path);

// Makes the folder unless it is there; kOutput where it cannot be made.
absl::Status MakeOutputFolder(const std::string& path);

// A file for each scan, named as the scan with this extension (".dss"), in the folder, which is
// made. kUsage for two scans of one name, kOutput where it cannot be made.
absl::StatusOr<std::vector<std::string>> PathsInFolder(const std::vector<std::string>& scans,
                                                       const std::string& folder,
                                                       const std::string& extension);

}  // namespace rilievo
