// Files that nobody finds, and that go with the last process that has them open.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// To be read and written, in this folder; in memory where `folder` is empty. NOT_FOUND or
// PERMISSION_DENIED when no file can be made there, RESOURCE_EXHAUSTED when there is no room.
absl::StatusOr<FileDescriptor> UnnamedFile(const std::string& folder);

}  // namespace rilievo
