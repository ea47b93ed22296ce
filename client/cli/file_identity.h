// Which file a path names, so that two names of one file are seen to be one.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace rilievo {

// A regular file by device and inode, whatever the links to it; one that is not there yet by its
// absolute path.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  std::string path;  // empty for a file that is there

  bool operator==(const FileIdentity&) const = default;
};

// "-" is what `standard_descriptor` is open on. None for devices, pipes and folders, which no
// result replaces.
std::optional<FileIdentity> IdentityOf(const std::string& path, int standard_descriptor);

}  // namespace rilievo
