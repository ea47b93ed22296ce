// A copy of a store that a server may be using.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace rilievo {

// Of jobs, scans and surfaces as they are at one moment, without cut uploads, into `target`, which
// is made or empty: a store that a server can be started on. Blobs never change, so they are hard
// links where the file system allows. ALREADY_EXISTS when `target` holds a store.
absl::Status BackUpStore(const std::string& folder, const std::string& target);

}  // namespace rilievo
