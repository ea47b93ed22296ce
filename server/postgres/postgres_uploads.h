// Uploads in PostgreSQL: one that was cut goes on at any server of a fleet.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/postgres/postgres_parts.h"
#include "server/store/scan_uploads.h"

namespace rilievo {

// Each writer has a turn, which the next one ends, wherever it is. A writer counts as such until it
// goes or has sent nothing for a minute.
class PostgresUploads final : public ScanUploads {
 public:
  // `blobs`: where scans go when they are whole; `in_parts`: that is the same database.
  PostgresUploads(std::shared_ptr<PostgresConnections> connections, const BlobStore* blobs,
                  bool in_parts)
      : connections_(std::move(connections)), blobs_(blobs), in_parts_(in_parts) {}

  absl::StatusOr<std::unique_ptr<UploadWriter>> Continue(const std::string& name,
                                                         int64_t offset) override;
  absl::StatusOr<int64_t> StoredBytes(const std::string& name) override;
  absl::StatusOr<bool> RemoveIfIdle(const std::string& name) override;
  absl::StatusOr<std::vector<FileEntry>> List() const override;

 private:
  const std::shared_ptr<PostgresConnections> connections_;
  const BlobStore* const blobs_;
  const bool in_parts_;
};

}  // namespace rilievo
