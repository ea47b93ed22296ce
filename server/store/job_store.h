// What a server remembers over its own end: jobs, their scans and their surfaces.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/os/file_descriptor.h"
#include "server/store/blob_folder.h"
#include "server/store/database.h"
#include "server/store/partial_uploads.h"

namespace rilievo {

// A job as it is kept. `job` is what its client sees.
struct StoredJob {
  std::string owner;   // whose jobs it is among; empty: nobody's in particular
  std::string client;  // whose turn it takes in the queue
  v1::ReconstructHeader header;
  std::string surface;  // its blob; empty before it succeeded
  v1::Job job;
};

inline bool IsFinished(v1::JobState state) {
  return state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_FAILED ||
         state == v1::JOB_STATE_CANCELLED;
}

// What is kept, for how long.
struct Retention {
  int64_t age_ms = 7 * 24 * 3600 * int64_t{1000};  // of finished jobs, unused scans, cut uploads
  int64_t bytes = 20'000'000'000;                  // of all scans, surfaces and uploads together
};

// A folder: `jobs.db` (SQLite), `blobs/`, `uploads/`, `lock`. Thread-safe; every function waits for
// the disk, and what it changed is on disk when it returns OK. RESOURCE_EXHAUSTED when the disk is
// full: nothing has changed then, and the same call may succeed later.
class JobStore {
 public:
  // Made when it is not there. UNAVAILABLE when another process uses it.
  static absl::StatusOr<std::unique_ptr<JobStore>> Open(const std::string& folder);

  // The scan of that name is `owner`'s too from now on: it showed that it has the bytes.
  absl::Status AddScan(const std::string& owner, const std::string& scan);

  // NOT_FOUND when there is none, or it is none of `owner`'s: to others it is as if it were not.
  absl::StatusOr<FileDescriptor> ReadScan(const std::string& owner, const std::string& scan);

  // Keeps `job`, unless its owner has one of the same request_id: then that one is returned.
  // NOT_FOUND when its scan is not stored, or none of the owner's.
  absl::StatusOr<StoredJob> Insert(const StoredJob& job);

  // NOT_FOUND when there is none, or it is another's.
  absl::StatusOr<StoredJob> Get(const std::string& owner, const std::string& job_id);

  // How many Get() calls were for a job of another owner.
  int64_t foreign_requests() const { return foreign_requests_; }

  // The request_id's job, when there is one.
  absl::StatusOr<std::optional<StoredJob>> Find(const std::string& owner,
                                                const std::string& request_id);

  // Newest first, at most `limit` (>= 1); `before`: of the page before, 0 for the first. Sets it
  // for the next page, to 0 after the last job.
  absl::StatusOr<std::vector<v1::Job>> List(const std::string& owner, int limit, int64_t* before);

  // Replaces what is kept of the job of that id, unless that is finished or was removed:
  // FAILED_PRECONDITION then. A finished job is never changed.
  absl::Status Update(const StoredJob& job);

  // The same for a job that succeeded: stores its surface first, and fills in `surface`.
  absl::Status Finish(StoredJob job, const std::vector<std::vector<uint8_t>>& surface);

  absl::Status Remove(const std::string& job_id);

  // Those that are not finished, oldest first.
  absl::StatusOr<std::vector<StoredJob>> Unfinished();

  // Removes what Retention no longer keeps: by age finished jobs, uploads and blobs that no job
  // refers to; then by size finished jobs, oldest first, with the blobs that only they refer to.
  // Returns the bytes that are stored.
  absl::StatusOr<int64_t> Clean(const Retention& retention, int64_t now_ms);

  const BlobFolder& blobs() const { return blobs_; }
  PartialUploads& uploads() { return *uploads_; }

 private:
  JobStore(FileDescriptor lock, Database database, BlobFolder blobs,
           std::unique_ptr<PartialUploads> uploads)
      : lock_(std::move(lock)),
        database_(std::move(database)),
        blobs_(std::move(blobs)),
        uploads_(std::move(uploads)) {}

  // With mutex_ held.
  absl::StatusOr<FileDescriptor> ReadScanLocked(const std::string& owner, const std::string& scan);
  absl::Status RemoveBlobs(const std::vector<std::string>& blobs);
  absl::Status ForgetScans(const std::vector<std::string>& blobs);
  absl::StatusOr<std::optional<StoredJob>> FindLocked(const std::string& owner,
                                                      const std::string& request_id);
  absl::StatusOr<int64_t> RemoveOldestFinished();
  absl::StatusOr<int64_t> RemoveUnusedBlobs(int64_t older_than_ms);
  absl::StatusOr<int64_t> RemoveIfUnused(const std::string& blob);

  const FileDescriptor lock_;
  std::atomic<int64_t> foreign_requests_{0};
  std::mutex mutex_;  // of the database, and of what refers to blobs
  Database database_;
  std::multiset<std::string> coming_;  // surfaces whose jobs do not refer to them yet
  const BlobFolder blobs_;
  const std::unique_ptr<PartialUploads> uploads_;
};

}  // namespace rilievo
