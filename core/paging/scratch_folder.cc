#include "core/paging/scratch_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "core/base/unnamed_file.h"
#include "core/codec/bytes/crc32c.h"
#include "core/paging/scratch_file.h"

namespace rilievo {
namespace {

constexpr char kLockName[] = "lock";
constexpr size_t kSavedChecksumBytes = sizeof(uint32_t);

// So that folders of other runs differ.
std::string FolderNameFor(const std::string& identity) {
  Sha256 hash;
  hash.Add({reinterpret_cast<const uint8_t*>(identity.data()), identity.size()});
  const auto digest = hash.Finish();
  return absl::StrCat("rilievo-run-",
                      absl::BytesToHexString(std::string(digest.begin(), digest.begin() + 8)));
}

// Others could change the files in it, or lead them elsewhere.
absl::Status UnsafeScratch(const std::string& folder, const std::string& what) {
  return OfScratchFolder(absl::PermissionDeniedError(
      absl::StrCat("scratch folder ", folder, " ", what, "; remove it, or name another folder")));
}

}  // namespace

absl::StatusOr<ScratchFolder> ScratchFolder::Kept(const std::string& path) {
  struct stat found;
  if (lstat(path.c_str(), &found) != 0) return ScratchError(path, errno);
  if (S_ISLNK(found.st_mode)) return UnsafeScratch(path, "is a symbolic link");
  const int number = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (number < 0) return ScratchError(path, errno);
  ScratchFolder folder(path);
  folder.open_ = std::shared_ptr<const int>(new int(number), [](const int* open_number) {
    close(*open_number);
    delete open_number;
  });
  if (fstat(number, &found) != 0) return ScratchError(path, errno);
  if (found.st_uid != geteuid()) return UnsafeScratch(path, "belongs to another user");
  if ((found.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return UnsafeScratch(path, "may be written to by other users");
  }
  return folder;
}

ScratchFolder ScratchFolder::OfFiles(std::string path, std::vector<int> numbers) {
  ScratchFolder folder(std::move(path));
  folder.files_ = std::make_shared<std::vector<int>>(std::move(numbers));
  return folder;
}

ScratchFolder ScratchFolder::WithoutNames() const {
  return files_ != nullptr ? *this : ScratchFolder(path_);
}

int ScratchFolder::MakeFile() const {
  if (files_ != nullptr) {
    if (files_->empty()) {
      errno = EMFILE;
      return -1;
    }
    const int number = files_->back();
    files_->pop_back();
    return number;
  }
  return OpenUnnamedFile(path_);
}

int ScratchFolder::OpenFile(const std::string& name, int flags) const {
  return openat(*open_, name.c_str(), flags | O_NOFOLLOW | O_CLOEXEC, 0600);
}

absl::Status ScratchFolder::Save(const std::string& name, std::span<const uint8_t> bytes) const {
  if (!keeps()) return absl::OkStatus();
  const std::string unfinished = absl::StrCat(name, ".new");
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(*this, unfinished));
  RILIEVO_RETURN_IF_ERROR(file.Resize(0));
  RILIEVO_RETURN_IF_ERROR(file.Append(bytes.data(), bytes.size()));
  const uint32_t checksum = Crc32c(bytes);
  RILIEVO_RETURN_IF_ERROR(file.Append(&checksum, sizeof(checksum)));
  if (renameat(*open_, unfinished.c_str(), *open_, name.c_str()) != 0) {
    return ScratchError(path_, errno);
  }
  return absl::OkStatus();
}

std::optional<std::vector<uint8_t>> ScratchFolder::Load(const std::string& name) const {
  struct stat found;
  if (!keeps() || fstatat(*open_, name.c_str(), &found, AT_SYMLINK_NOFOLLOW) != 0) {
    return std::nullopt;
  }
  const absl::StatusOr<ScratchFile> file = ScratchFile::Create(*this, name);
  if (!file.ok() || file->size() < static_cast<int64_t>(kSavedChecksumBytes)) return std::nullopt;
  std::vector<uint8_t> bytes(static_cast<size_t>(file->size()));
  if (!file->ReadAt(0, bytes.data(), bytes.size()).ok()) return std::nullopt;
  uint32_t checksum = 0;
  const size_t count = bytes.size() - kSavedChecksumBytes;
  std::memcpy(&checksum, bytes.data() + count, kSavedChecksumBytes);
  bytes.resize(count);
  if (Crc32c(bytes) != checksum) return std::nullopt;
  return bytes;
}

absl::StatusOr<KeptScratch> KeptScratch::Open(const std::string& path,
                                              const std::string& identity) {
  const std::string of_run = absl::StrCat(path, "/", FolderNameFor(identity));
  if (mkdir(of_run.c_str(), 0700) != 0 && errno != EEXIST) return ScratchError(path, errno);
  RILIEVO_ASSIGN_OR_RETURN(ScratchFolder folder, ScratchFolder::Kept(of_run));
  const int lock = folder.OpenFile(kLockName, O_RDWR | O_CREAT);
  if (lock < 0) return ScratchError(of_run, errno);
  KeptScratch scratch(std::move(folder), lock);
  if (flock(lock, LOCK_EX | LOCK_NB) != 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "scratch folder ", of_run,
        ": another process works on the same scan with the same options; wait for it"));
  }
  return scratch;
}

KeptScratch::~KeptScratch() {
  if (lock_ >= 0) close(lock_);
}

void KeptScratch::Remove() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_.path(), ignored);
}

}  // namespace rilievo
