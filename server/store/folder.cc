#include "server/store/folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::Status MakeFolder(const std::string& path) {
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) {
    return StatusOfErrno(errno, "making " + path);
  }
  return SyncFolder(std::filesystem::absolute(path).parent_path().string());
}

absl::Status SyncFolder(const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor folder, OpenFile(path, O_RDONLY | O_DIRECTORY));
  return SyncFile(folder);
}

absl::Status SyncFile(const FileDescriptor& file) {
  if (fsync(file.number()) != 0) return StatusOfErrno(errno, "writing to disk");
  return absl::OkStatus();
}

absl::StatusOr<FileDescriptor> OpenFile(const std::string& path, int flags) {
  FileDescriptor file(open(path.c_str(), flags | O_CLOEXEC, 0600));
  if (file.valid()) return file;
  if (errno == ENOENT) return absl::NotFoundError(absl::StrCat(path, " is not there"));
  return StatusOfErrno(errno, "opening " + path);
}

absl::Status RemoveFile(const std::string& path) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) {
    return StatusOfErrno(errno, "removing " + path);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<FileEntry>> ListFiles(const std::string& folder) {
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(opendir(folder.c_str()), closedir);
  if (!entries) return StatusOfErrno(errno, "reading " + folder);
  std::vector<FileEntry> files;
  while (const dirent* entry = readdir(entries.get())) {
    struct stat status {};
    // One that is gone by now is left out.
    if (fstatat(dirfd(entries.get()), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0 ||
        !S_ISREG(status.st_mode)) {
      continue;
    }
    files.push_back({entry->d_name, static_cast<int64_t>(status.st_size),
                     status.st_mtim.tv_sec * 1000 + status.st_mtim.tv_nsec / 1'000'000});
  }
  std::sort(files.begin(), files.end(),
            [](const FileEntry& a, const FileEntry& b) { return a.name < b.name; });
  return files;
}

absl::StatusOr<FileDescriptor> LockFolder(const std::string& folder) {
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor lock, OpenFile(folder + "/lock", O_RDWR | O_CREAT));
  if (flock(lock.number(), LOCK_EX | LOCK_NB) == 0) return lock;
  return absl::UnavailableError(
      absl::StrCat(folder, " is in use by another server; give each its own --store"));
}

}  // namespace rilievo
