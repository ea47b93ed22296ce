#include "server/os/unnamed_file.h"

#include <sys/mman.h>

#include <cerrno>

#include "absl/strings/str_cat.h"
#include "core/base/unnamed_file.h"

namespace rilievo {

absl::StatusOr<FileDescriptor> UnnamedFile(const std::string& folder) {
  if (folder.empty()) {
    FileDescriptor memory(memfd_create("rilievo", MFD_CLOEXEC));
    if (!memory.valid()) return StatusOfErrno(errno, "a file in memory");
    return memory;
  }
  FileDescriptor file(OpenUnnamedFile(folder));
  if (!file.valid()) {
    const absl::Status why = StatusOfErrno(errno, absl::StrCat("a file in ", folder));
    switch (errno) {
      case ENOENT:
      case ENOTDIR:
        return absl::NotFoundError(why.message());
      case EACCES:
      case EPERM:
      case EROFS:
        return absl::PermissionDeniedError(why.message());
      default:
        return why;
    }
  }
  return file;
}

}  // namespace rilievo
