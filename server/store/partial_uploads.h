// Uploads as files of a folder that grow.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/blob_folder.h"
#include "server/store/folder.h"
#include "server/store/scan_uploads.h"

namespace rilievo {

class PartialUploads final : public ScanUploads {
 public:
  // In the folder `path`, of the file system of `blobs`, which takes what is whole.
  static absl::StatusOr<std::unique_ptr<PartialUploads>> Open(std::string path, BlobFolder blobs);

  absl::StatusOr<std::unique_ptr<UploadWriter>> Continue(const std::string& name,
                                                         int64_t offset) override;
  absl::StatusOr<int64_t> StoredBytes(const std::string& name) override;
  absl::StatusOr<bool> RemoveIfIdle(const std::string& name) override;
  absl::StatusOr<std::vector<FileEntry>> List() const override { return ListFiles(path_); }

 private:
  class Writer;
  struct File;

  PartialUploads(std::string path, BlobFolder blobs)
      : path_(std::move(path)), blobs_(std::move(blobs)) {}

  std::shared_ptr<File> FileOf(const std::string& name);

  const std::string path_;
  const BlobFolder blobs_;
  std::mutex mutex_;
  // While somebody has a writer.
  std::map<std::string, std::weak_ptr<File>> files_;
};

}  // namespace rilievo
