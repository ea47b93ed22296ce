#include "server/os/unnamed_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

#include "absl/strings/str_cat.h"

namespace rilievo {

absl::StatusOr<FileDescriptor> UnnamedFile(const std::string& folder) {
  if (folder.empty()) {
    FileDescriptor memory(memfd_create("rilievo", MFD_CLOEXEC));
    if (!memory.valid()) return StatusOfErrno(errno, "a file in memory");
    return memory;
  }
  std::string name = absl::StrCat(folder, "/rilievo-scratch-XXXXXX");
  FileDescriptor file(mkostemp(name.data(), O_CLOEXEC));
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
  unlink(name.c_str());
  return file;
}

}  // namespace rilievo
