// Files named by the SHA-256 of their bytes: written once, never changed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"
#include "server/store/folder.h"

namespace rilievo {

// Thread-safe, as files are. A file that has its name is whole and on disk: it is written under
// another name, synced, renamed, and its folder synced.
class BlobFolder {
 public:
  // What was not finished when the last process ended is removed.
  static absl::StatusOr<BlobFolder> Open(std::string path);

  // Bytes that are on their way into the folder; removed with it unless it was adopted.
  class Staged {
   public:
    Staged(std::string path, FileDescriptor file, std::string name, int64_t bytes)
        : path_(std::move(path)), file_(std::move(file)), name_(std::move(name)), bytes_(bytes) {}
    Staged(Staged&& other, std::string name, int64_t bytes)
        : Staged(std::move(other.path_), std::move(other.file_), std::move(name), bytes) {}
    Staged(Staged&& other) = default;
    ~Staged();

    const std::string& path() const { return path_; }
    const FileDescriptor& file() const { return file_; }
    const std::string& name() const { return name_; }  // that the blob will have
    int64_t bytes() const { return bytes_; }

   private:
    std::string path_;
    FileDescriptor file_;
    std::string name_;
    int64_t bytes_;
  };
  absl::StatusOr<Staged> Stage(const std::vector<std::vector<uint8_t>>& parts) const;

  // Stages and adopts; the blob's name.
  absl::StatusOr<std::string> Put(const std::vector<std::vector<uint8_t>>& parts) const;

  // Takes a whole file of the same file system into the folder as `name`, the SHA-256 of its bytes;
  // `path` is gone then. Its age begins anew when it was here before.
  absl::Status Adopt(const std::string& path, const FileDescriptor& file,
                     const std::string& name) const;

  // NOT_FOUND when there is none of that name, or the name is none.
  absl::StatusOr<FileDescriptor> Read(const std::string& name) const;

  absl::Status Remove(const std::string& name) const;

  // Moves one whose bytes are not those of its name to the folder of damaged ones beside this.
  absl::Status SetAside(const std::string& name) const;

  absl::StatusOr<std::vector<FileEntry>> List() const;

 private:
  explicit BlobFolder(std::string path) : path_(std::move(path)) {}

  std::string path_;
};

}  // namespace rilievo
