// Folders and files that are on disk when a function says so.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// Made when it is not there, for its owner only. An entry in its parent is on disk on return.
absl::Status MakeFolder(const std::string& path);

// The entries of a folder: what was created, renamed or removed in it stays so.
absl::Status SyncFolder(const std::string& path);

absl::Status SyncFile(const FileDescriptor& file);

// `path`, open with `flags`; NOT_FOUND when it is not there.
absl::StatusOr<FileDescriptor> OpenFile(const std::string& path, int flags);

// OK also when it was not there.
absl::Status RemoveFile(const std::string& path);

struct FileEntry {
  std::string name;
  int64_t bytes = 0;
  int64_t modified_ms = 0;  // since 1970
};

// Regular files in order of their names.
absl::StatusOr<std::vector<FileEntry>> ListFiles(const std::string& folder);

// Takes the folder for this process until it ends; UNAVAILABLE when another process has it.
absl::StatusOr<FileDescriptor> LockFolder(const std::string& folder);

}  // namespace rilievo
