// Blobs as files of a folder.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"
#include "server/store/blob_store.h"
#include "server/store/folder.h"

namespace rilievo {

// A file that has its name is whole and on disk: it is written under another name, synced, renamed,
// and its folder synced.
class BlobFolder final : public BlobStore {
 public:
  enum class Users {
    kOneProcess,
    kMany,  // on any machine that has the folder, as by NFS
  };
  // What was not finished when the last process ended is removed; where others may be at it, what
  // was not finished for a day.
  static absl::StatusOr<BlobFolder> Open(std::string path, Users users = Users::kOneProcess);

  absl::StatusOr<std::unique_ptr<StagedBlob>> StageFrom(const BlobSource& next) const override;
  absl::StatusOr<int64_t> BytesOf(const std::string& name) const override;
  absl::Status Remove(const std::string& name) const override;
  // To the folder `damaged` beside this one.
  absl::Status SetAside(const std::string& name) const override;
  absl::StatusOr<std::vector<FileEntry>> List() const override;

  // Takes a whole file of the same file system into the folder as `name`, the SHA-256 of its bytes;
  // `path` is gone then.
  absl::Status Adopt(const std::string& path, const FileDescriptor& file,
                     const std::string& name) const;

 private:
  absl::StatusOr<FileDescriptor> Fetch(const std::string& name,
                                       const std::function<void()>& moved) const override;

  explicit BlobFolder(std::string path) : path_(std::move(path)) {}

  std::string path_;
};

}  // namespace rilievo
