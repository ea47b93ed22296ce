#include "client/formats/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

absl::Status WriteError(const std::string& path, int reason) {
  const std::string message = absl::StrCat(
      path, ": cannot be written: ", reason != 0 ? std::strerror(reason) : "no reason given");
  if (reason == EACCES || reason == EPERM || reason == EROFS) {
    return absl::PermissionDeniedError(message);
  }
  if (reason == ENOENT || reason == ENOTDIR) return absl::NotFoundError(message);
  return absl::ResourceExhaustedError(message);
}

absl::Status WriteThrough(const std::string& path, const std::string& shown,
                          const std::function<absl::Status(std::ostream&)>& write) {
  errno = 0;
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  if (!out) return WriteError(shown, errno);
  RILIEVO_RETURN_IF_ERROR(write(out));
  out.close();
  if (!out) return WriteError(shown, errno);
  return absl::OkStatus();
}

absl::Status WriteToStandardOutput(const std::function<absl::Status(std::ostream&)>& write) {
  errno = 0;
  RILIEVO_RETURN_IF_ERROR(write(std::cout));
  std::cout.flush();
  return std::cout ? absl::OkStatus() : WriteError("the standard output", errno);
}

// An empty file of a name nobody has, with the permissions a new file gets.
absl::Status MakeTemporary(const std::string& path, std::string* temporary) {
  *temporary = absl::StrCat(path, ".XXXXXX");
  const int descriptor = mkstemp(temporary->data());
  if (descriptor < 0) return WriteError(path, errno);
  const mode_t mask = umask(0);
  umask(mask);
  fchmod(descriptor, 0666 & ~mask);
  close(descriptor);
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteFileAtomically(const std::string& path,
                                 const std::function<absl::Status(std::ostream& out)>& write) {
  if (path == "-") return WriteToStandardOutput(write);
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": is a folder; give a file name"));
  }
  if (fs::exists(status) && !fs::is_regular_file(status)) return WriteThrough(path, path, write);

  // A link is followed, so that the file it points to is replaced and not the link.
  const std::string target =
      fs::exists(status) ? fs::canonical(path, error).string() : std::string(path);
  std::string temporary;
  RILIEVO_RETURN_IF_ERROR(MakeTemporary(target, &temporary));
  const absl::Status written = WriteThrough(temporary, path, write);
  if (!written.ok()) {
    fs::remove(temporary, error);
    return written;
  }
  if (std::rename(temporary.c_str(), target.c_str()) != 0) {
    const int reason = errno;
    fs::remove(temporary, error);
    return WriteError(path, reason);
  }
  return absl::OkStatus();
}

absl::Status WriteBytesAtomically(const std::string& path, std::span<const unsigned char> bytes) {
  return WriteFileAtomically(path, [&](std::ostream& out) {
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    return absl::OkStatus();
  });
}

absl::Status CheckWritable(const std::string& path) {
  if (path == "-") return absl::OkStatus();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": is a folder; give a file name"));
  }
  const fs::path folder = fs::path(path).parent_path();
  const bool special = fs::exists(status) && !fs::is_regular_file(status);
  const std::string asked = special ? path : folder.empty() ? "." : folder.string();
  if (access(asked.c_str(), special ? W_OK : W_OK | X_OK) != 0) return WriteError(path, errno);
  return absl::OkStatus();
}

}  // namespace rilievo
