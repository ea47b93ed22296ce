// A store in a folder whose blobs a test puts out of reach, as a network does.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/conversion/server_options.h"
#include "server/store/blob_folder.h"
#include "server/store/job_store.h"
#include "server/store/partial_uploads.h"
#include "server/store/store_tables.h"

namespace rilievo {

struct Distance {
  std::atomic<bool> away = false;
  std::atomic<int> heard = 0;  // how many reads were told to say that bytes come
};

class FarBlobs final : public BlobStore {
 public:
  FarBlobs(BlobFolder folder, Distance* distance)
      : folder_(std::move(folder)), distance_(*distance) {}

  absl::StatusOr<std::unique_ptr<StagedBlob>> StageFrom(const BlobSource& next) const override {
    return folder_.StageFrom(next);
  }
  absl::StatusOr<int64_t> BytesOf(const std::string& name) const override {
    return folder_.BytesOf(name);
  }
  absl::Status Remove(const std::string& name) const override { return folder_.Remove(name); }
  absl::Status SetAside(const std::string& name) const override { return folder_.SetAside(name); }
  absl::StatusOr<std::vector<FileEntry>> List() const override { return folder_.List(); }

 private:
  absl::StatusOr<FileDescriptor> Fetch(const std::string& name,
                                       const std::function<void()>& moved) const override {
    if (distance_.away) return absl::UnavailableError("S3: HTTP 503 SlowDown");
    if (moved) {
      moved();
      ++distance_.heard;
    }
    return folder_.Read(name);
  }

  const BlobFolder folder_;
  Distance& distance_;
};

// In options.store.
inline absl::StatusOr<std::unique_ptr<JobStore>> OpenFarStore(const ServerOptions& options,
                                                              StoreSettings settings,
                                                              Distance* distance) {
  const std::string& folder = options.store;
  RILIEVO_RETURN_IF_ERROR(MakeFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(BlobFolder blobs, BlobFolder::Open(folder + "/blobs"));
  RILIEVO_ASSIGN_OR_RETURN(JobTables tables, OpenTables(folder, blobs));
  StoreParts parts;
  RILIEVO_ASSIGN_OR_RETURN(parts.uploads, PartialUploads::Open(folder + "/uploads", blobs));
  std::vector<std::unique_ptr<JobTables>> one;
  one.push_back(std::make_unique<JobTables>(std::move(tables)));
  parts.tables = std::make_unique<LeasePool<JobTables>>(std::move(one));
  parts.blobs = std::make_unique<FarBlobs>(std::move(blobs), distance);
  parts.clock = StoreClock::System();
  return JobStore::Open(std::move(parts), std::move(settings));
}

}  // namespace rilievo
