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

absl::StatusOr<std::string> Write(const std::vector<std::vector<uint8_t>>& parts,
                                  const FileDescriptor& file) {
  Sha256 hash;
  for (const auto& part : parts) {
    AddBytes(part.data(), part.size(), &hash);
    RILIEVO_RETURN_IF_ERROR(file.Write(part.data(), part.size()));
  }
  return ContentName(hash);
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

absl::StatusOr<std::string> BlobFolder::Put(const std::vector<std::vector<uint8_t>>& parts) const {
  const std::string path = path_ + "/" + NewName();
  RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor file, OpenFile(path, O_RDWR | O_CREAT | O_EXCL));
  absl::StatusOr<std::string> name = Write(parts, file);
  absl::Status status = name.ok() ? Adopt(path, file, *name) : name.status();
  if (!status.ok()) {
    RemoveFile(path).IgnoreError();
    return status;
  }
  return name;
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

absl::StatusOr<std::vector<FileEntry>> BlobFolder::List() const {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<FileEntry> files, ListFiles(path_));
  std::erase_if(files, [](const FileEntry& file) { return !IsContentName(file.name); });
  return files;
}

}  // namespace rilievo
