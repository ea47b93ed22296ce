#include "server/store/blob_folder.h"

#include <fcntl.h>

#include <cerrno>
#include <cstdio>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/content_name.h"
#include "server/store/store_clock.h"

namespace rilievo {
namespace {

constexpr int64_t kDay = 24 * 3600 * int64_t{1000};

// Nobody else's, on no machine.
std::string NewName() {
  std::random_device random;
  return absl::StrCat("new-", absl::Hex(random(), absl::kZeroPad8),
                      absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8));
}

class StagedFile final : public StagedBlob {
 public:
  StagedFile(const BlobFolder& folder, std::string path, FileDescriptor file, std::string name,
             int64_t bytes)
      : StagedBlob(std::move(name), bytes),
        folder_(folder),
        path_(std::move(path)),
        file_(std::move(file)) {}
  // Adopted, it is no longer there.
  ~StagedFile() override { RemoveFile(path_).IgnoreError(); }

  absl::Status Adopt(Database* /*tables*/) const override {
    return folder_.Adopt(path_, file_, name());
  }

 private:
  const BlobFolder& folder_;
  const std::string path_;
  const FileDescriptor file_;
};

}  // namespace

absl::StatusOr<BlobFolder> BlobFolder::Open(std::string path, Users users) {
  RILIEVO_RETURN_IF_ERROR(MakeFolder(path));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, ListFiles(path));
  const int64_t now_ms = StoreClock::System().wall_ms();
  for (const FileEntry& file : files) {
    const bool over = users == Users::kOneProcess || now_ms - file.modified_ms > kDay;
    if (over && !IsContentName(file.name)) {
      RILIEVO_RETURN_IF_ERROR(RemoveFile(path + "/" + file.name));
    }
  }
  return BlobFolder(std::move(path));
}

absl::StatusOr<std::unique_ptr<StagedBlob>> BlobFolder::StageFrom(const BlobSource& next) const {
  Sha256 hash;
  int64_t bytes = 0;
  const std::string path = path_ + "/" + NewName();
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor file, OpenFile(path, O_RDWR | O_CREAT | O_EXCL));
  const auto write = [&]() -> absl::Status {
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const std::string_view part, next());
      if (part.empty()) return SyncFile(file);
      AddBytes(part.data(), part.size(), &hash);
      RILIEVO_RETURN_IF_ERROR(file.Write(part.data(), part.size()));
      bytes += static_cast<int64_t>(part.size());
    }
  };
  if (const absl::Status written = write(); !written.ok()) {
    RemoveFile(path).IgnoreError();
    return written;
  }
  return std::make_unique<StagedFile>(*this, path, std::move(file), ContentName(hash), bytes);
}

absl::Status BlobFolder::Adopt(const std::string& path, const FileDescriptor& file,
                               const std::string& name) const {
  RILIEVO_RETURN_IF_ERROR(SyncFile(file));
  if (std::rename(path.c_str(), (path_ + "/" + name).c_str()) != 0) {
    return StatusOfErrno(errno, "naming a stored file");
  }
  return SyncFolder(path_);
}

absl::StatusOr<FileDescriptor> BlobFolder::Fetch(const std::string& name,
                                                 const std::function<void()>& /*moved*/) const {
  if (!IsContentName(name)) return absl::NotFoundError("no such file is stored");
  return OpenFile(path_ + "/" + name, O_RDONLY);
}

absl::StatusOr<int64_t> BlobFolder::BytesOf(const std::string& name) const {
  RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor file, Read(name));
  return file.Size();
}

// No other name is that of a blob: it might be that of the folder itself.
absl::Status BlobFolder::Remove(const std::string& name) const {
  if (!IsContentName(name)) return absl::OkStatus();
  return RemoveFile(path_ + "/" + name);
}

absl::Status BlobFolder::SetAside(const std::string& name) const {
  if (!IsContentName(name)) return absl::OkStatus();
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
