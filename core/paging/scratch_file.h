// A file without a name in a scratch folder: it goes with the process, however that ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

// RESOURCE_EXHAUSTED, naming the folder and both sizes, where less than `bytes` are free in it.
absl::Status CheckRoom(const std::string& folder, int64_t bytes);

class ScratchFile {
 public:
  // NOT_FOUND, PERMISSION_DENIED or RESOURCE_EXHAUSTED, naming the folder.
  static absl::StatusOr<ScratchFile> Create(const std::string& folder);
  ScratchFile(ScratchFile&& other) noexcept
      : folder_(std::move(other.folder_)),
        number_(std::exchange(other.number_, -1)),
        size_(other.size_) {}
  ScratchFile& operator=(ScratchFile&& other) noexcept;
  ~ScratchFile();

  const std::string& folder() const { return folder_; }
  // Bytes up to the end of the last write.
  int64_t size() const { return size_; }
  // RESOURCE_EXHAUSTED, naming the folder, when it is full.
  absl::Status WriteAt(int64_t offset, const void* data, size_t bytes);
  absl::Status Append(const void* data, size_t bytes) { return WriteAt(size_, data, bytes); }
  // DATA_LOSS where the file ends before.
  absl::Status ReadAt(int64_t offset, void* data, size_t bytes) const;

 private:
  ScratchFile(std::string folder, int number) : folder_(std::move(folder)), number_(number) {}
  absl::Status Failed(int error) const;

  std::string folder_;
  int number_ = -1;
  int64_t size_ = 0;
};

}  // namespace rilievo
