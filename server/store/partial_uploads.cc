#include "server/store/partial_uploads.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

constexpr int64_t kBlockBytes = 1 << 20;

// Of the first `size` bytes.
absl::StatusOr<Sha256> HashOf(const FileDescriptor& file, int64_t size) {
  Sha256 hash;
  std::string block;
  for (int64_t at = 0; at < size; at += kBlockBytes) {
    block.resize(static_cast<size_t>(std::min(kBlockBytes, size - at)));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    AddBytes(block.data(), block.size(), &hash);
  }
  return hash;
}

// An upload that is whole: it stays one unless it is adopted.
class WholeUpload final : public StagedBlob {
 public:
  WholeUpload(const BlobFolder& blobs, const std::string& path, const FileDescriptor& file,
              const std::string& name, int64_t bytes)
      : StagedBlob(name, bytes), blobs_(blobs), path_(path), file_(file) {}

  absl::Status Adopt(Database* /*tables*/) const override {
    return blobs_.Adopt(path_, file_, name());
  }

 private:
  const BlobFolder& blobs_;
  const std::string& path_;
  const FileDescriptor& file_;
};

}  // namespace

struct PartialUploads::File {
  explicit File(std::string file_path) : path(std::move(file_path)) {}

  const std::string path;
  std::mutex mutex;
  uint64_t turn = 0;  // of the writer that may write
  FileDescriptor file;
  // Of all bytes while they came in one go; a hash of what is stored is worth its reading only
  // once, at the end.
  std::optional<Sha256> hash;
  int64_t size = 0;
};

class PartialUploads::Writer final : public UploadWriter {
 public:
  Writer(const BlobFolder& blobs, std::shared_ptr<File> file, uint64_t turn, int64_t size)
      : blobs_(blobs), file_(std::move(file)), turn_(turn), size_(size) {}

  absl::Status Append(const std::string& bytes) override;
  int64_t size() const override { return size_; }
  absl::Status Finish(int64_t total_bytes, const std::string& sha256, const Take& take) override;

 private:
  const BlobFolder& blobs_;
  const std::shared_ptr<File> file_;
  const uint64_t turn_;
  int64_t size_;
};

absl::StatusOr<std::unique_ptr<PartialUploads>> PartialUploads::Open(std::string path,
                                                                     BlobFolder blobs) {
  RILIEVO_RETURN_IF_ERROR(MakeFolder(path));
  return std::unique_ptr<PartialUploads>(new PartialUploads(std::move(path), std::move(blobs)));
}

std::shared_ptr<PartialUploads::File> PartialUploads::FileOf(const std::string& name) {
  const std::lock_guard lock(mutex_);
  std::erase_if(files_, [](const auto& entry) { return entry.second.expired(); });
  auto file = files_[name].lock();
  if (!file) {
    file = std::make_shared<File>(path_ + "/" + name);
    files_[name] = file;
  }
  return file;
}

absl::StatusOr<std::unique_ptr<UploadWriter>> PartialUploads::Continue(const std::string& name,
                                                                       int64_t offset) {
  const auto file = FileOf(name);
  const std::lock_guard lock(file->mutex);
  const uint64_t turn = ++file->turn;  // from here on no earlier writer writes
  RILIEVO_ASSIGN_OR_RETURN(file->file, OpenFile(file->path, O_RDWR | O_CREAT));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t stored, file->file.Size());
  if (offset > stored) return OffsetBeyondStored(offset, stored);
  file->hash.reset();
  if (offset == 0) file->hash.emplace();
  if (ftruncate(file->file.number(), offset) != 0 ||
      lseek(file->file.number(), offset, SEEK_SET) < 0) {
    return StatusOfErrno(errno, "upload");
  }
  file->size = offset;
  return std::make_unique<Writer>(blobs_, file, turn, offset);
}

absl::StatusOr<int64_t> PartialUploads::StoredBytes(const std::string& name) {
  const auto file = OpenFile(path_ + "/" + name, O_RDONLY);
  if (absl::IsNotFound(file.status())) return 0;
  RILIEVO_RETURN_IF_ERROR(file.status());
  return file->Size();
}

absl::StatusOr<bool> PartialUploads::RemoveIfIdle(const std::string& name) {
  const std::lock_guard lock(mutex_);  // nobody begins to write meanwhile
  const auto found = files_.find(name);
  if (found != files_.end() && !found->second.expired()) return false;
  RILIEVO_RETURN_IF_ERROR(RemoveFile(path_ + "/" + name));
  return true;
}

absl::Status PartialUploads::Writer::Append(const std::string& bytes) {
  const std::lock_guard lock(file_->mutex);
  if (file_->turn != turn_) return UploadTakenOver();
  if (const absl::Status written = file_->file.Write(bytes.data(), bytes.size()); !written.ok()) {
    // What was written of it is dropped, so that the size stays that of whole messages.
    if (ftruncate(file_->file.number(), size_) != 0) ++file_->turn;
    lseek(file_->file.number(), size_, SEEK_SET);
    return written;
  }
  if (file_->hash) AddBytes(bytes.data(), bytes.size(), &*file_->hash);
  size_ += static_cast<int64_t>(bytes.size());
  file_->size = size_;
  return absl::OkStatus();
}

absl::Status PartialUploads::Writer::Finish(int64_t total_bytes, const std::string& sha256,
                                            const Take& take) {
  const std::lock_guard lock(file_->mutex);
  if (file_->turn != turn_) return UploadTakenOver();
  if (size_ == total_bytes && !file_->hash) {
    RILIEVO_ASSIGN_OR_RETURN(file_->hash, HashOf(file_->file, size_));
  }
  const std::string stored = file_->hash ? ContentName(*file_->hash) : "";
  if (size_ != total_bytes || stored != sha256) {
    ++file_->turn;
    RILIEVO_RETURN_IF_ERROR(RemoveFile(file_->path));
    return UploadMismatch(total_bytes, sha256, size_, stored);
  }
  RILIEVO_RETURN_IF_ERROR(take(WholeUpload(blobs_, file_->path, file_->file, sha256, size_)));
  ++file_->turn;
  return absl::OkStatus();
}

}  // namespace rilievo
