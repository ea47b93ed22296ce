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

}  // namespace

ScratchFolder ScratchFolder::Kept(std::string path) {
  ScratchFolder folder(std::move(path));
  folder.keeps_ = true;
  return folder;
}

absl::Status ScratchFolder::Save(const std::string& name, std::span<const uint8_t> bytes) const {
  if (!keeps_) return absl::OkStatus();
  const std::string unfinished = absl::StrCat(name, ".new");
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(*this, unfinished));
  RILIEVO_RETURN_IF_ERROR(file.Resize(0));
  RILIEVO_RETURN_IF_ERROR(file.Append(bytes.data(), bytes.size()));
  const uint32_t checksum = Crc32c(bytes);
  RILIEVO_RETURN_IF_ERROR(file.Append(&checksum, sizeof(checksum)));
  if (rename(absl::StrCat(path_, "/", unfinished).c_str(),
             absl::StrCat(path_, "/", name).c_str()) != 0) {
    return ScratchError(path_, errno);
  }
  return absl::OkStatus();
}

std::optional<std::vector<uint8_t>> ScratchFolder::Load(const std::string& name) const {
  struct stat found;
  if (!keeps_ || stat(absl::StrCat(path_, "/", name).c_str(), &found) != 0) return std::nullopt;
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
  const std::string folder = absl::StrCat(path, "/", FolderNameFor(identity));
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return ScratchError(path, errno);
  const int lock =
      open(absl::StrCat(folder, "/", kLockName).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) return ScratchError(folder, errno);
  KeptScratch scratch(ScratchFolder::Kept(folder), lock);
  if (flock(lock, LOCK_EX | LOCK_NB) != 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "scratch folder ", folder,
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
