// Files that appear whole or not at all.
#pragma once

#include <functional>
#include <ostream>
#include <span>
#include <string>

#include "absl/status/status.h"

namespace rilievo {

// Lets `write` fill a temporary file beside `path`, then renames it over `path`. When anything
// fails, or the process dies, an older file at `path` is left as it was. A device or pipe at `path`
// is written directly, and "-" is the standard output. The message of an error names the path.
absl::Status WriteFileAtomically(const std::string& path,
                                 const std::function<absl::Status(std::ostream& out)>& write);

// The same with bytes that are there already.
absl::Status WriteBytesAtomically(const std::string& path, std::span<const unsigned char> bytes);

// Whether a file could be written at `path`, asked before long work: its folder exists and takes
// new files. OK does not promise that it will be.
absl::Status CheckWritable(const std::string& path);

}  // namespace rilievo
