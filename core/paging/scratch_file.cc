#include "core/paging/scratch_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace rilievo {
namespace {

absl::StatusCode CodeOfErrno(int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return absl::StatusCode::kNotFound;
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::StatusCode::kPermissionDenied;
    default:
      return absl::StatusCode::kResourceExhausted;
  }
}

constexpr char kPayload[] = "rilievo/scratch-folder";

}  // namespace

absl::Status OfScratchFolder(absl::Status status) {
  status.SetPayload(kPayload, absl::Cord());
  return status;
}

bool IsOfScratchFolder(const absl::Status& status) {
  return status.GetPayload(kPayload).has_value();
}

absl::Status CheckRoom(const ScratchFolder& folder, int64_t bytes) {
  struct statvfs disk;
  if (statvfs(folder.path().c_str(), &disk) != 0) return absl::OkStatus();  // writing will tell
  const double free = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
  if (static_cast<double>(bytes) <= free) return absl::OkStatus();
  return OfScratchFolder(absl::ResourceExhaustedError(absl::StrFormat(
      "scratch folder %s: %.1f MB more are needed, %.1f MB are free; free some space, or name "
      "another folder",
      folder.path(), 1e-6 * static_cast<double>(bytes), 1e-6 * free)));
}

absl::Status ScratchError(const std::string& folder, int error) {
  if (error == ELOOP) {
    return OfScratchFolder(absl::PermissionDeniedError(
        absl::StrCat("scratch folder ", folder,
                     ": a file of this run is a symbolic link there; remove the folder, or name "
                     "another one")));
  }
  const char* remedy = error == ENOSPC || error == EDQUOT
                           ? "; free some space, or name another folder: 60 bytes a point are "
                             "needed there, and 300 MB where they are kept"
                           : "";
  return OfScratchFolder(absl::Status(
      CodeOfErrno(error),
      absl::StrCat("scratch folder ", folder, ": ", std::string(strerror(error)), remedy)));
}

absl::StatusOr<ScratchFile> ScratchFile::Create(const ScratchFolder& folder,
                                                const std::string& kept_name) {
  if (folder.keeps()) {
    ScratchFile file(folder, folder.OpenFile(kept_name, O_RDWR | O_CREAT));
    struct stat found;
    if (file.number_ < 0 || fstat(file.number_, &found) != 0) return file.Failed(errno);
    file.size_ = found.st_size;
    return file;
  }
  ScratchFile file(folder, folder.MakeFile());
  if (file.number_ < 0) return file.Failed(errno);
  return file;
}

ScratchFile& ScratchFile::operator=(ScratchFile&& other) noexcept {
  std::swap(folder_, other.folder_);
  std::swap(number_, other.number_);
  std::swap(size_, other.size_);
  return *this;
}

ScratchFile::~ScratchFile() {
  if (number_ >= 0) close(number_);
}

absl::Status ScratchFile::WriteAt(int64_t offset, const void* data, size_t bytes) {
  const char* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = pwrite(number_, from, bytes, offset);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return Failed(errno);
    from += written;
    offset += written;
    bytes -= static_cast<size_t>(written);
  }
  size_ = std::max(size_, offset);
  return absl::OkStatus();
}

absl::Status ScratchFile::Resize(int64_t bytes) {
  if (ftruncate(number_, bytes) != 0) return Failed(errno);
  size_ = bytes;
  return absl::OkStatus();
}

int64_t ScratchFile::BytesOnDisk() const {
  constexpr int64_t kBlock = 512;
  struct stat found;
  return fstat(number_, &found) == 0 ? kBlock * found.st_blocks : 0;
}

absl::Status ScratchFile::ReadAt(int64_t offset, void* data, size_t bytes) const {
  char* to = static_cast<char*>(data);
  while (bytes > 0) {
    const ssize_t taken = pread(number_, to, bytes, offset);
    if (taken < 0 && errno == EINTR) continue;
    if (taken < 0) return Failed(errno);
    if (taken == 0) {
      return absl::DataLossError(absl::StrCat("scratch folder ", folder_.path(),
                                              ": a file of this run is shorter than it was"));
    }
    to += taken;
    offset += taken;
    bytes -= static_cast<size_t>(taken);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
