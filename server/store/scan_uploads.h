// Scans that have not arrived whole, and go on arriving after a break.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/blob_store.h"

namespace rilievo {

// Who sends an upload, as long as no later one does: then its calls end with ABORTED.
class UploadWriter {
 public:
  virtual ~UploadWriter() = default;

  // Its bytes may be lost by a crash of the machine, which Finish() of a later writer would notice.
  virtual absl::Status Append(const std::string& bytes) = 0;

  // Where the next byte goes.
  virtual int64_t size() const = 0;

  // Hands what is stored to `take`, which adopts it, when it has `total_bytes` and this SHA-256
  // (hexadecimal); otherwise DATA_LOSS, and the upload is dropped. Reads what is stored of an
  // upload that went on, as its hash is not known.
  using Take = std::function<absl::Status(const StagedBlob& staged)>;
  virtual absl::Status Finish(int64_t total_bytes, const std::string& sha256, const Take& take) = 0;

  // Calls `moved` now and then while Finish() gets on, where that may take long.
  void WhenMoved(std::function<void()> moved) { moved_ = std::move(moved); }

 protected:
  void Move() const {
    if (moved_) moved_();
  }

 private:
  std::function<void()> moved_;
};

// Thread-safe. An upload has one writer, the latest.
class ScanUploads {
 public:
  virtual ~ScanUploads() = default;

  // Goes on with upload `name` (letters, digits, '-', '_' and '.') at `offset`; what is stored
  // beyond is dropped. OUT_OF_RANGE when less is stored.
  virtual absl::StatusOr<std::unique_ptr<UploadWriter>> Continue(const std::string& name,
                                                                 int64_t offset) = 0;

  // 0 when there is none.
  virtual absl::StatusOr<int64_t> StoredBytes(const std::string& name) = 0;

  // Removes one unless somebody has a writer of it; false then.
  virtual absl::StatusOr<bool> RemoveIfIdle(const std::string& name) = 0;

  virtual absl::StatusOr<std::vector<FileEntry>> List() const = 0;
};

// What a writer says when a later one has begun.
absl::Status UploadTakenOver();

// What is said of an offset beyond the bytes that are stored.
absl::Status OffsetBeyondStored(int64_t offset, int64_t stored);

// What is said of bytes that are not those announced; `name`: theirs, empty when it is not known.
absl::Status UploadMismatch(int64_t total_bytes, const std::string& sha256, int64_t bytes,
                            const std::string& name);

}  // namespace rilievo
