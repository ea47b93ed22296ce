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
  // `scratch`: the folder of files that are read; empty: they are in memory.
  static absl::StatusOr<std::unique_ptr<PostgresBlobs>> Open(
      std::shared_ptr<PostgresConnections> connections, std::string scratch);

  absl::StatusOr<std::unique_ptr<StagedBlob>> StageFrom(const BlobSource& next) const override;
  absl::StatusOr<int64_t> BytesOf(const std::string& name) const override;
  absl::Status Remove(const std::string& name) const override;
  // Under the name "damaged:" and its own.
  absl::Status SetAside(const std::string& name) const override;
  absl::StatusOr<std::vector<FileEntry>> List() const override;

 private:
  absl::StatusOr<FileDescriptor> Fetch(const std::string& name,
                                       const std::function<void()>& moved) const override;

  PostgresBlobs(std::shared_ptr<PostgresConnections> connections, std::string scratch)
      : connections_(std::move(connections)), scratch_(std::move(scratch)) {}

  const std::shared_ptr<PostgresConnections> connections_;
  const std::string scratch_;
};

}  // namespace rilievo
