#include "server/store/disk_room.h"

#include <fcntl.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cstdio>

#include "core/base/status_macros.h"
#include "server/store/folder.h"

namespace rilievo {
namespace {

constexpr int64_t kMostBytes = 4 << 20, kLeastBytes = 64 << 10;

// A sixteenth of what is free.
int64_t ReserveBytes(const std::string& folder) {
  struct statvfs disk {};
  if (statvfs(folder.c_str(), &disk) != 0) return kLeastBytes;
  const int64_t free = static_cast<int64_t>(disk.f_bavail) * static_cast<int64_t>(disk.f_frsize);
  return std::clamp(free / 16, kLeastBytes, kMostBytes);
}

}  // namespace

DiskRoom::DiskRoom(const std::string& folder)
    : path_(folder + "/reserve"), bytes_(ReserveBytes(folder)) {
  if (!OpenFile(path_, O_RDONLY).ok()) full_ = !Reserve().ok();
}

absl::Status DiskRoom::Reserve() {
  const std::string fresh = path_ + ".new";
  {
    RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor file, OpenFile(fresh, O_RDWR | O_CREAT));
    if (const int error = posix_fallocate(file.number(), 0, bytes_); error != 0) {
      RemoveFile(fresh).IgnoreError();
      return StatusOfErrno(error, "room on the disk");
    }
  }
  if (std::rename(fresh.c_str(), path_.c_str()) != 0) {
    return StatusOfErrno(errno, "room on the disk");
  }
  return absl::OkStatus();
}

absl::Status DiskRoom::Check() {
  if (!full_) return absl::OkStatus();
  const std::lock_guard lock(mutex_);
  RILIEVO_RETURN_IF_ERROR(Reserve());
  full_ = false;
  return absl::OkStatus();
}

void DiskRoom::Note(const absl::Status& written) {
  if (absl::IsResourceExhausted(written)) full_ = true;
}

void DiskRoom::Release() {
  const std::lock_guard lock(mutex_);
  full_ = true;
  RemoveFile(path_).IgnoreError();
}

}  // namespace rilievo
