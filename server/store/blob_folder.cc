#include "server/store/blob_folder.h"

#include <fcntl.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

// Unique within this process, the only one that writes here.
std::string NewName() {
  static std::atomic<uint64_t> number{0};
  return absl::StrCat("new-", number++);
}

}  // namespace

absl::StatusOr<BlobFolder> BlobFolder::Open(std::string path) {
  RILIEVO_RETURN_IF_ERROR(MakeFolder(path));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, ListFiles(path));
  for (const FileEntry& file : files) {
    if (!IsContentName(file.name)) RILIEVO_RETURN_IF_ERROR(RemoveFile(path + "/" + file.name));
  }
  return BlobFolder(std::move(path));
}

BlobFolder::Staged::~Staged() {
  // Adopted or moved from, it is no longer there.
  if (file_.valid()) RemoveFile(path_).IgnoreError();
}

absl::StatusOr<BlobFolder::Staged> BlobFolder::Stage(
    const std::vector<std::vector<uint8_t>>& parts) const {
  Sha256 hash;
  int64_t bytes = 0;
  const std::string path = path_ + "/" + NewName();
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor file, OpenFile(path, O_RDWR | O_CREAT | O_EXCL));
  Staged staged(path, std::move(file), "", 0);
  for (const auto& part : parts) {
    AddBytes(part.data(), part.size(), &hash);
    RILIEVO_RETURN_IF_ERROR(staged.file().Write(part.data(), part.size()));
    bytes += static_cast<int64_t>(part.size());
  }
  RILIEVO_RETURN_IF_ERROR(SyncFile(staged.file()));
  return Staged(std::move(staged), ContentName(hash), bytes);
}

absl::StatusOr<std::string> BlobFolder::Put(const std::vector<std::vector<uint8_t>>& parts) const {
  RILIEVO_ASSIGN_OR_RETURN(const Staged staged, Stage(parts));
  RILIEVO_RETURN_IF_ERROR(Adopt(staged.path(), staged.file(), staged.name()));
  return staged.name();
}

absl::Status BlobFolder::Adopt(const std::string& path, const FileDescriptor& file,
                               const std::string& name) const {
  RILIEVO_RETURN_IF_ERROR(SyncFile(file));
  if (std::rename(path.c_str(), (path_ + "/" + name).c_str()) != 0) {
    return StatusOfErrno(errno, "naming a stored file");
  }
  return SyncFolder(path_);
}

absl::StatusOr<FileDescriptor> BlobFolder::Read(const std::string& name) const {
  if (!IsContentName(name)) return absl::NotFoundError("no such file is stored");
  return OpenFile(path_ + "/" + name, O_RDONLY);
}

absl::Status BlobFolder::Remove(const std::string& name) const {
  return RemoveFile(path_ + "/" + name);
}

absl::Status BlobFolder::SetAside(const std::string& name) const {
  const std::string folder = path_.substr(0, path_.rfind('/')) + "/damaged";
  RILIEVO_RETURN_IF_ERROR(MakeFolder(folder));
  if (std::rename((path_ + "/" + name).c_str(), (folder + "/" + name).c_str()) != 0 &&
      errno != ENOENT) {
    return StatusOfErrno(errno, "setting a damaged file aside");
  }
  return SyncFolder(path_);
}

absl::StatusOr<std::vector<FileEntry>> BlobFolder::List() const {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<FileEntry> files, ListFiles(path_));
  std::erase_if(files, [](const FileEntry& file) { return !IsContentName(file.name); });
  return files;
}

}  // namespace rilievo
