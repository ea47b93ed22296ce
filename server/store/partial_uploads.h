// Scans that have not arrived whole: files that grow, and go on growing after a break.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"
#include "server/store/content_name.h"
#include "server/store/folder.h"

namespace rilievo {

// Thread-safe. An upload has one writer, the latest: the calls of an earlier one end with ABORTED.
class PartialUploads {
 public:
  static absl::StatusOr<std::unique_ptr<PartialUploads>> Open(std::string path);

  class Writer {
   public:
    // Its bytes are handed to the system, not yet on disk: a crash of the machine may lose the
    // latest, which Finish() of a later writer would notice.
    absl::Status Append(const std::string& bytes);

    // Where the next byte goes.
    int64_t size() const;

    // Hands the file to `take`, which moves it away, when it has `total_bytes` and this SHA-256
    // (hexadecimal); otherwise DATA_LOSS, and the upload is dropped. Reads what is stored of an
    // upload that went on, as its hash is not known.
    using Take = std::function<absl::Status(const std::string& path, const FileDescriptor& file)>;
    absl::Status Finish(int64_t total_bytes, const std::string& sha256, const Take& take);

   private:
    friend class PartialUploads;
    struct File;
    Writer(std::shared_ptr<File> file, uint64_t turn, int64_t size)
        : file_(std::move(file)), turn_(turn), size_(size) {}

    std::shared_ptr<File> file_;
    uint64_t turn_;
    int64_t size_;
  };

  // Goes on with upload `name` (letters, digits, '-', '_' and '.') at `offset`; what is stored
  // beyond is dropped. OUT_OF_RANGE when less is stored.
  absl::StatusOr<Writer> Continue(const std::string& name, int64_t offset);

  // 0 when there is none.
  absl::StatusOr<int64_t> StoredBytes(const std::string& name);

  // Removes one unless somebody has a writer of it; false then.
  absl::StatusOr<bool> RemoveIfIdle(const std::string& name);

  absl::StatusOr<std::vector<FileEntry>> List() const { return ListFiles(path_); }

 private:
  explicit PartialUploads(std::string path) : path_(std::move(path)) {}

  std::shared_ptr<Writer::File> FileOf(const std::string& name);

  const std::string path_;
  std::mutex mutex_;
  // While somebody has a writer.
  std::map<std::string, std::weak_ptr<Writer::File>> files_;
};

}  // namespace rilievo
