// Blobs in PostgreSQL, so that a fleet needs nothing else to keep its bytes in.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/postgres/postgres_parts.h"
#include "server/store/blob_store.h"

namespace rilievo {

class PostgresBlobs final : public BlobStore {
 public:
  // Removes what was begun a day ago and never became a blob, and what was set aside a week ago.
  static absl::StatusOr<std::unique_ptr<PostgresBlobs>> Open(
      std::shared_ptr<PostgresConnections> connections);

  absl::StatusOr<std::unique_ptr<StagedBlob>> StageFrom(const BlobSource& next) const override;
  absl::StatusOr<int64_t> BytesOf(const std::string& name) const override;
  absl::Status Remove(const std::string& name) const override;
  // Under the name "damaged:" and its own.
  absl::Status SetAside(const std::string& name) const override;
  absl::StatusOr<std::vector<FileEntry>> List() const override;

 private:
  // In memory.
  absl::StatusOr<FileDescriptor> Fetch(const std::string& name,
                                       const std::function<void()>& moved) const override;

  explicit PostgresBlobs(std::shared_ptr<PostgresConnections> connections)
      : connections_(std::move(connections)) {}

  const std::shared_ptr<PostgresConnections> connections_;
};

}  // namespace rilievo
