// Scans, surfaces and control meshes as a store keeps them: under the SHA-256 of their bytes,
// written once, never changed.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"
#include "server/store/database.h"
#include "server/store/folder.h"

namespace rilievo {

// Bytes that are on their way into a store, which must outlive this object; gone with this object
// unless they were adopted.
class StagedBlob {
 public:
  StagedBlob(std::string name, int64_t bytes) : name_(std::move(name)), bytes_(bytes) {}
  virtual ~StagedBlob() = default;
  StagedBlob(const StagedBlob&) = delete;
  StagedBlob& operator=(const StagedBlob&) = delete;

  const std::string& name() const { return name_; }  // that the blob will have
  int64_t bytes() const { return bytes_; }

  // Makes a blob of them, on disk when it returns. Its age begins anew when it was there before.
  // `tables`: in a transaction, of which it is a part where blobs are in that database too; null
  // without one.
  virtual absl::Status Adopt(Database* tables) const = 0;

 private:
  const std::string name_;
  const int64_t bytes_;
};

// The next bytes, valid until the next call; none at the end.
using BlobSource = std::function<absl::StatusOr<std::string_view>()>;

// Thread-safe. A blob that has its name is whole.
class BlobStore {
 public:
  virtual ~BlobStore() = default;

  virtual absl::StatusOr<std::unique_ptr<StagedBlob>> StageFrom(const BlobSource& next) const = 0;
  absl::StatusOr<std::unique_ptr<StagedBlob>> Stage(
      const std::vector<std::vector<uint8_t>>& parts) const;

  // Stages and adopts; the blob's name.
  absl::StatusOr<std::string> Put(const std::vector<std::vector<uint8_t>>& parts) const;

  // A file of the blob's bytes, to be read from any place in it; it stays whole though the blob be
  // removed. Where the bytes come over a network, `moved`, if any, is called as they come.
  // NOT_FOUND when there is no blob of that name, or the name is not that of a blob.
  absl::StatusOr<FileDescriptor> Read(const std::string& name,
                                      const std::function<void()>& moved = {}) const {
    return Fetch(name, moved);
  }

  // NOT_FOUND as Read().
  virtual absl::StatusOr<int64_t> BytesOf(const std::string& name) const = 0;

  // OK also when there was none.
  virtual absl::Status Remove(const std::string& name) const = 0;

  // Takes one whose bytes are not those of its name out of the way, for an operator to look at; OK
  // also when there was none.
  virtual absl::Status SetAside(const std::string& name) const = 0;

  virtual absl::StatusOr<std::vector<FileEntry>> List() const = 0;

  // What was let go and is still there goes, where that takes longer than letting go. Called now
  // and then; takes some seconds at most while all goes well.
  virtual absl::Status Sweep() const { return absl::OkStatus(); }

 private:
  // Read().
  virtual absl::StatusOr<FileDescriptor> Fetch(const std::string& name,
                                               const std::function<void()>& moved) const = 0;
};

}  // namespace rilievo
