#include "client/cli/file_identity.h"

#include <sys/stat.h>

#include <filesystem>
#include <system_error>

namespace rilievo {

std::optional<FileIdentity> IdentityOf(const std::string& path, int standard_descriptor) {
  struct stat status {};
  const bool found =
      path == "-" ? fstat(standard_descriptor, &status) == 0 : stat(path.c_str(), &status) == 0;
  if (found) {
    if (!S_ISREG(status.st_mode)) return std::nullopt;
    return FileIdentity{status.st_dev, status.st_ino, ""};
  }
  if (path == "-") return std::nullopt;
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  return FileIdentity{0, 0, std::filesystem::weakly_canonical(absolute, error).string()};
}

}  // namespace rilievo
