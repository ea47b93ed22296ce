// A folder that ends with its server.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

class TemporaryFolder {
 public:
  // Beneath the system's folder for temporary files ($TMPDIR, else /tmp), for this user alone.
  // Removes what servers left there that were killed. UNAVAILABLE when nothing can be written
  // there.
  static absl::StatusOr<std::unique_ptr<TemporaryFolder>> Make();

  // Removes it and all it holds.
  ~TemporaryFolder();

  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  // Empty at first.
  std::string path() const { return outer_ + "/store"; }

 private:
  TemporaryFolder(std::string outer, FileDescriptor lock)
      : outer_(std::move(outer)), lock_(std::move(lock)) {}

  const std::string outer_;
  const FileDescriptor lock_;
};

}  // namespace rilievo
