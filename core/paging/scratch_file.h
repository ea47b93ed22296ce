// A file in a scratch folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/paging/scratch_folder.h"

namespace rilievo {

// RESOURCE_EXHAUSTED, naming the folder and both sizes, where less than `bytes` are free in it.
absl::Status CheckRoom(const ScratchFolder& folder, int64_t bytes);

// NOT_FOUND, PERMISSION_DENIED or RESOURCE_EXHAUSTED for what errno says of a folder.
absl::Status ScratchError(const std::string& folder, int error);
// The same error, which IsOfScratchFolder() then knows.
absl::Status OfScratchFolder(absl::Status status);
// Whether it is one: no files can be written there, or no more.
bool IsOfScratchFolder(const absl::Status& status);

class ScratchFile {
 public:
  // As `folder` has files: without a name, or that name, with what an earlier run has left in it.
  // The errors of ScratchError().
  static absl::StatusOr<ScratchFile> Create(const ScratchFolder& folder, const std::string& name);
  ScratchFile(ScratchFile&& other) noexcept
      : folder_(std::move(other.folder_)),
        number_(std::exchange(other.number_, -1)),
        size_(other.size_) {}
  ScratchFile& operator=(ScratchFile&& other) noexcept;
  ~ScratchFile();

  const ScratchFolder& folder() const { return folder_; }
  // Bytes up to the end of the last write.
  int64_t size() const { return size_; }
  // RESOURCE_EXHAUSTED, naming the folder, when it is full.
  absl::Status WriteAt(int64_t offset, const void* data, size_t bytes);
  absl::Status Append(const void* data, size_t bytes) { return WriteAt(size_, data, bytes); }
  // Zeros where it is longer than before.
  absl::Status Resize(int64_t bytes);
  // What the file system has room for already.
  int64_t BytesOnDisk() const;
  // DATA_LOSS where the file ends before.
  absl::Status ReadAt(int64_t offset, void* data, size_t bytes) const;

 private:
  ScratchFile(ScratchFolder folder, int number) : folder_(std::move(folder)), number_(number) {}
  absl::Status Failed(int error) const { return ScratchError(folder_.path(), error); }

  ScratchFolder folder_;
  int number_ = -1;
  int64_t size_ = 0;
};

}  // namespace rilievo
