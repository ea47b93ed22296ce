// Blobs as objects of an S3 bucket; the database of the fleet says which object is which blob.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/s3/s3_bucket.h"
#include "server/store/blob_store.h"
#include "server/store/database.h"
#include "server/store/lease_pool.h"

namespace rilievo {

// Rows of the table `objects` of PostgreSQL. Each object has a key of its own, which never comes
// again: what is written, adopted and removed at the same time by many servers cannot meet, and
// nobody waits for the bucket with a lock of the database. A row is there before its object and
// goes after it, so that nothing is left in the bucket that no row knows.
class S3Blobs final : public BlobStore {
 public:
  // Writes and removes a small object, to see that it may. UNAVAILABLE when it cannot. `scratch`:
  // the folder of files that are read; empty: they are in memory.
  static absl::StatusOr<std::unique_ptr<S3Blobs>> Open(
      std::shared_ptr<LeasePool<Database>> connections, const S3Place& place,
      std::string scratch = {});

  absl::StatusOr<std::unique_ptr<StagedBlob>> StageFrom(const BlobSource& next) const override;
  // As the table has it: who makes a job does not wait for the bucket.
  absl::StatusOr<int64_t> BytesOf(const std::string& name) const override;
  absl::Status Remove(const std::string& name) const override;
  // The object stays for a week; its row has the name as `was`.
  absl::Status SetAside(const std::string& name) const override;
  absl::StatusOr<std::vector<FileEntry>> List() const override;
  absl::Status Sweep() const override;

 private:
  absl::StatusOr<FileDescriptor> Fetch(const std::string& name,
                                       const std::function<void()>& moved) const override;

  S3Blobs(std::shared_ptr<LeasePool<Database>> connections, const S3Place& place,
          std::string scratch)
      : connections_(std::move(connections)), bucket_(place), scratch_(std::move(scratch)) {}

  struct Object {
    std::string key;
    int64_t bytes = 0;
  };
  absl::StatusOr<Object> Find(const std::string& name) const;
  // Takes the name of a blob from its object, which is to be removed after that time.
  absl::Status LetGo(const std::string& name, const std::string& after) const;

  // What is to be removed.
  struct Leftover {
    std::string key;
    std::string upload;  // one in parts that may not have ended; may be empty
  };
  absl::StatusOr<std::vector<Leftover>> TakeLeftovers() const;
  // Several at a time, for a removal is a wait for the bucket; then their rows. The first error
  // ends it.
  absl::Status RemoveObjects(const std::vector<Leftover>& leftovers) const;

  const std::shared_ptr<LeasePool<Database>> connections_;
  const S3Bucket bucket_;
  const std::string scratch_;
};

}  // namespace rilievo
