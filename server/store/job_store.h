// What a server remembers over its own end: jobs, their scans and their surfaces.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/os/file_descriptor.h"
#include "server/store/blob_store.h"
#include "server/store/disk_room.h"
#include "server/store/job_queue.h"
#include "server/store/job_record.h"
#include "server/store/job_tables.h"
#include "server/store/lease_pool.h"
#include "server/store/part_queue.h"
#include "server/store/scan_uploads.h"
#include "server/store/store_clock.h"

namespace rilievo {

// What is kept, for how long.
struct Retention {
  int64_t age_ms = 7 * 24 * 3600 * int64_t{1000};  // of finished jobs, idle scans, cut uploads
  int64_t bytes = 20'000'000'000;                  // of scans, surfaces, meshes, uploads, records
  int64_t owner_bytes = 0;                         // of them of one owner; 0: no limit
};

struct StoreSettings {
  Retention retention = {};
  // The system's for a folder; the database's for a shared store, whose tests alone set it.
  std::optional<StoreClock::Source> clock = {};
  // Where scans and surfaces that come over a network lie while they are read; empty: in memory.
  std::string scratch = {};
  // Of the parts of large jobs one in so many is done twice, and compared; >= 1.
  int64_t checked_share = 100;
  // Told of what an operator should know, a line each; called with the store locked.
  std::function<void(const std::string&)> report = {};
};

// What a store is made of.
struct StoreParts {
  std::unique_ptr<LeasePool<JobTables>> tables;
  std::unique_ptr<BlobStore> blobs;
  std::unique_ptr<ScanUploads> uploads;
  std::unique_ptr<DiskRoom> room;  // null where this process does not see the disk
  StoreClock::Source clock;
  FileDescriptor lock = {};  // of who alone may use it
  bool shared = false;       // other processes use it at the same time
};

// Thread-safe; every function waits for the disk or the database, and what it changed is on disk
// when it returns OK. RESOURCE_EXHAUSTED when the disk is full or the store has no room,
// UNAVAILABLE when another program holds the database or it cannot be reached: nothing has changed
// then, unless the connection broke at the very end, and the same call may succeed later.
class JobStore {
 public:
  // A folder: `jobs.db` (SQLite), `blobs/`, `uploads/`, `reserve`, `lock`. Made when it is not
  // there. UNAVAILABLE when another process uses it; else as OpenTables().
  static absl::StatusOr<std::unique_ptr<JobStore>> Open(const std::string& folder,
                                                        StoreSettings settings = {});

  static absl::StatusOr<std::unique_ptr<JobStore>> Open(StoreParts parts, StoreSettings settings);

  // Keeps how far the store's clock got, and gives free pages back.
  ~JobStore();

  // Whether other servers and workers use it at the same time. Then jobs are taken by Claim() and
  // their workers change them with the claim they have.
  bool shared() const { return shared_; }

  // Makes room for an upload of that many bytes and counts it as the owner's. Room is made of what
  // can go (idle scans, cut uploads, finished jobs, oldest first): the owner's own above its limit
  // and where nobody takes more; else of who takes most.
  absl::Status BeginUpload(const std::string& owner, const std::string& name, int64_t bytes);

  // Takes a whole upload as a scan of `owner`'s; else DATA_LOSS, and it is dropped.
  absl::Status FinishUpload(const std::string& owner, const std::string& name, int64_t bytes,
                            const std::string& sha256, UploadWriter* writer);

  // The scan of that name, whose blob is there, is `owner`'s too from now on.
  absl::Status AddScan(const std::string& owner, const std::string& scan);

  // Its bytes. NOT_FOUND when there is none, and when it belongs to others, who thus stay
  // unknown. One that is lost or has another size is forgotten.
  absl::StatusOr<int64_t> BytesOfScan(const std::string& owner, const std::string& scan);

  // It is no longer the owner's; NOT_FOUND when it was not. Its bytes go when no other owner and no
  // unfinished job needs them.
  absl::Status RemoveScan(const std::string& owner, const std::string& scan);

  // Its bytes are not what its name says: nobody has it any more, so that a new upload heals it.
  absl::Status SetScanAside(const std::string& scan);

  // Keeps `job`, unless its owner has one of the same request_id: then that one is returned, and a
  // mesh of its header as blob in both cases. NOT_FOUND when its scan is not stored, or none of the
  // owner's. Room is made as for an upload, but not of its scan.
  absl::StatusOr<StoredJob> Insert(const StoredJob& job);

  // NOT_FOUND when there is none, or it is another's; DATA_LOSS when its record is damaged.
  absl::StatusOr<StoredJob> Get(const std::string& owner, const std::string& job_id);

  // How many Get() calls were for a job of another owner.
  int64_t foreign_requests() const { return foreign_requests_; }

  // The request_id's job, when there is one.
  absl::StatusOr<std::optional<StoredJob>> Find(const std::string& owner,
                                                const std::string& request_id);

  // Newest first, at most `limit` (>= 1); `before`: of the page before, 0 for the first. Sets it
  // for the next page, to 0 after the last job. It counts the owner's own jobs.
  absl::StatusOr<std::vector<v1::Job>> List(const std::string& owner, int limit, int64_t* before);

  // Replaces what is kept of the job of that id, unless that is finished or was removed, or the
  // job names a claim that is no longer in force: FAILED_PRECONDITION then. A finished job is never
  // changed.
  absl::Status Update(const StoredJob& job);

  // The same, and gives up the claim: whoever comes next may work on it; `last`: when what waits
  // now has been taken.
  absl::Status Release(const StoredJob& job, bool last = false);

  // The same for a job that succeeded: stores its surface first, and fills in `surface`.
  absl::Status Finish(StoredJob job, const std::vector<std::vector<uint8_t>>& surface);

  // With its surface, and its scan unless another job of its owner names it.
  absl::Status Remove(const std::string& owner, const std::string& job_id);

  // Those that are not finished, oldest first.
  absl::StatusOr<std::vector<StoredJob>> Unfinished();

  // Of a shared store: the next job that this worker is to work on, if there is one.
  absl::StatusOr<std::optional<StoredJob>> Claim(const ClaimDemand& demand);
  // The claims of that worker, which go on.
  // `freed`: set to the number of other workers' jobs that are anybody's now.
  absl::StatusOr<std::vector<JobClaim>> Renew(const ClaimDemand& worker, int64_t* freed = nullptr);
  // Gives up one of which nothing is known here.
  absl::Status Release(const JobClaim& claim);
  // For those who watch the job elsewhere.
  absl::Status Tell(const JobClaim& claim, const v1::JobEvent& event);
  struct Glance {
    v1::Job job;
    std::optional<v1::JobEvent> event;  // the latest, unless it is that of the state
  };
  absl::StatusOr<Glance> Look(const std::string& owner, const std::string& job_id);
  absl::StatusOr<JobQueue::Counts> CountUnfinished(const std::string& client);

  // Parts of a large job; see PartQueue.
  // Drops those of another recipe, as workers of another version have left them.
  absl::Status LeadParts(const PartWorker& leader);
  absl::StatusOr<PartQueue::Turn> TakePart(const PartWorker& worker, PartStep step, int count);
  // Stores what came of it, in the room that Insert() has kept free for the job, or what can be
  // made (BeginUpload()): else STORE_FULL. OK also where somebody else has it by now: it is the
  // same. FAILED_PRECONDITION where the job is not there any more; INTERNAL as PartQueue::Finish().
  absl::Status KeepPart(const PartClaim& claim, const BlobSource& bytes);
  // What came of one that is done; NOT_FOUND where that is not there any more.
  absl::StatusOr<FileDescriptor> ReadPart(const std::string& job_id, PartStep step, int part,
                                          std::string* sha256);
  // It is lost or damaged, and to be done again.
  absl::Status DropPart(const PartWorker& worker, PartStep step, int part,
                        const std::string& sha256);
  absl::Status ReleaseParts(const std::string& job_id, const std::string& worker);
  // Of the jobs with parts that wait for help, the first that is none of `except`; its `worker` is
  // NameOfHelper().
  absl::StatusOr<std::optional<StoredJob>> JobToHelp(const ClaimDemand& worker,
                                                     const std::string& recipe,
                                                     const std::set<std::string>& except);
  // Whether somebody still waits for it.
  absl::StatusOr<bool> IsUnfinished(const std::string& job_id);

  // Removes what retention no longer keeps, by age, then by size. Returns the bytes that are
  // stored.
  absl::StatusOr<int64_t> Clean();

  // Whether a write found no room, and there is none yet.
  bool full() const { return room_ && room_->full(); }
  // Looks whether there is room again.
  void LookForRoom();

  const BlobStore& blobs() const { return *blobs_; }
  ScanUploads& uploads() { return *uploads_; }

 private:
  JobStore(StoreParts parts, StoreSettings settings, const StoreClock& clock);

  // What files and tables do not agree on after a crash.
  absl::Status Reconcile(JobTables* tables);
  absl::Status ReconcileUploads(JobTables* tables);

  // `body` as one transaction; then blobs that it left unused are removed.
  absl::Status Change(JobTables* tables, const std::function<absl::Status()>& body);
  absl::Status Write(JobTables* tables, const std::function<absl::Status()>& body);  // takes room
  absl::Status Free(JobTables* tables, const std::function<absl::Status()>& body);   // gives room
  // Those of these blobs that no table names.
  absl::Status RemoveUnnamed(JobTables* tables, const std::vector<std::string>& names);
  // Takes staged bytes into the tables by `body`; removes them when that fails and nobody had them.
  absl::Status Adopt(JobTables* tables, const StagedBlob& staged,
                     const std::function<absl::Status()>& body);
  // Within a transaction: a change to a job that is not finished, with the claim it names.
  absl::Status ChangeJob(JobTables* tables, const StoredJob& job);
  absl::StatusOr<int64_t> BytesOfScan(JobTables* tables, const std::string& owner,
                                      const std::string& scan);
  // ABORTED where the room for its parts was taken by others meanwhile.
  absl::StatusOr<StoredJob> TryToInsert(StoredJob job);
  // What an owner's room is made for, which does not go meanwhile; "": none.
  struct Spared {
    std::string upload = {};
    std::string scan = {};
  };
  // STORE_FULL before anything goes where even without all that can go there is not enough.
  absl::Status MakeRoom(JobTables* tables, const std::string& owner, int64_t bytes,
                        const Spared& spared);
  absl::StatusOr<bool> HasRoom(JobTables* tables, const std::string& owner, int64_t bytes);
  absl::Status CheckRoom(JobTables* tables, const std::string& owner, int64_t bytes,
                         const Spared& spared);
  // The same for what comes of a part, as far as it takes more than what is kept free for it.
  absl::Status MakeRoomForPart(JobTables* tables, const PartClaim& claim, const StagedBlob& result);
  absl::StatusOr<bool> Evict(JobTables* tables, const std::string& owner, const Spared& spared);
  absl::StatusOr<bool> EvictForSize(JobTables* tables, const std::string& owner, int64_t bytes,
                                    const Spared& spared);
  int64_t BytesOfOwner() const;  // that one may have
  absl::Status RemoveOld();
  absl::Status KeepTime(JobTables* tables);
  void ReportDamaged(JobTables* tables);
  void Report(const std::string& line) const;

  // Parts that the runs of this process hold, whose leases go on: by job and worker, of whom each
  // holds one.
  void Hold(const std::string& job_id, const std::string& worker,
            const std::optional<PartClaim>& claim);
  std::vector<PartClaim> HeldBy(const std::string& worker) const;

  const bool shared_;
  const FileDescriptor lock_;
  const StoreSettings settings_;
  const StoreClock clock_;
  std::atomic<int64_t> foreign_requests_{0};
  const std::unique_ptr<LeasePool<JobTables>> tables_;
  const std::unique_ptr<BlobStore> blobs_;
  const std::unique_ptr<ScanUploads> uploads_;
  const std::unique_ptr<DiskRoom> room_;
  mutable std::mutex held_mutex_;
  std::map<std::pair<std::string, std::string>, PartClaim> held_;
};

}  // namespace rilievo
