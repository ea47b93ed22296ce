#include "server/os/private_files.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/stat.h>

#include <cerrno>

#include "absl/strings/str_cat.h"
#include "core/base/sanitized.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

void KeepToThisUser() {
  umask(077);
  if (!kSanitized) prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
}

absl::Status WriteSecret(const std::string& path, const std::string& text) {
  const FileDescriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (!file.valid() && errno == EEXIST) {
    return absl::AlreadyExistsError(absl::StrCat(path, " is there already; name another file"));
  }
  if (!file.valid()) return StatusOfErrno(errno, path);
  return file.Write(text.data(), text.size());
}

bool IsOpenToOthers(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && (status.st_mode & S_IRWXO) != 0;
}

}  // namespace rilievo
